// Opens each report from file:// and checks what a reader relies on. Reports and their JSON lie in the current folder.
import assert from 'node:assert/strict';
import {readFileSync, readdirSync, statSync} from 'node:fs';
import {loadavg} from 'node:os';
import {resolve} from 'node:path';
import {chromium} from 'playwright-core';

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM,
  args: ['--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update',
         '--disable-sync', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
});

async function open(name, colorScheme = 'light') {
  const page = await browser.newPage({viewport: {width: 1280, height: 720}, colorScheme});
  page.setDefaultTimeout(120000);  // a busy machine is no fault of the page
  const troubles = [];
  page.on('console', (m) => m.type() === 'error' && troubles.push(`console: ${m.text()}`));
  page.on('pageerror', (e) => troubles.push(`exception: ${e.message}`));
  page.on('request', (r) => /^(file|data|blob):/.test(r.url()) || troubles.push(`request: ${r.url()}`));
  const start = Date.now();
  await page.goto(`file://${resolve(`${name}.html`)}`);
  await page.waitForFunction(() => document.documentElement.dataset.ready, undefined, {polling: 20});
  return {page, troubles, seconds: (Date.now() - start) / 1000};
}

// Every fact with an exact number equals the field of that name in the JSON file.
async function factsEqualJson(page, name) {
  const json = JSON.parse(readFileSync(`${name}.json`, 'utf8'));
  const flat = {...json.residual, ...json};
  const facts = await page.$$eval('dd[data-value]', (all) => all.map((d) => [d.dataset.fact, Number(d.dataset.value)]));
  let compared = 0;
  for (const [key, value] of facts) {
    if (!(key in flat)) continue;
    assert.equal(value, flat[key], `${name}: ${key}`);
    compared++;
  }
  const embedded = await page.$eval('#result', (e) => JSON.parse(e.textContent));
  assert.deepEqual(embedded, json, `${name}: the embedded result`);
  return compared;
}

// Every number in a table is one of the JSON file's, rounded to the digits shown (in its own unit, or mm as um, a share as per cent).
async function tablesShowJson(page, name) {
  const numbers = [];
  const collect = (v) => (typeof v === 'number' ? numbers.push(v) : v && typeof v === 'object' && Object.values(v).forEach(collect));
  collect(JSON.parse(readFileSync(`${name}.json`, 'utf8')));
  const all = Float64Array.from(numbers.flatMap((n) => [n, 1000 * n, 100 * n, -n])).sort();
  const nearest = (v) => {
    let [low, high] = [0, all.length - 1];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (all[middle] < v) low = middle + 1;
      else high = middle;
    }
    return Math.min(Math.abs(all[low] - v), low > 0 ? Math.abs(all[low - 1] - v) : Infinity);
  };
  // What each effect of a model does to the readings ("does / µm") is worked out for the page alone.
  const cells = await page.$$eval('figure:not(#effects) td.number', (tds) => tds.map((td) => td.textContent.trim()));
  let compared = 0;
  for (const cell of cells) {
    const [, digits, exponent] = /^-?\d+(?:\.(\d+))?(?:e([-+]\d+))?$/.exec(cell) ?? [null];
    if (exponent === undefined && digits === undefined && !/^-?\d+$/.test(cell)) continue;  // a dash, a word
    const step = 10 ** (Number(exponent ?? 0) - (digits ?? '').length);
    assert.ok(nearest(Number(cell)) <= 0.5001 * step, `${name}: ${cell} stands in a table and not in the JSON`);
    compared++;
  }
  return compared;
}

// The first sentence is made of the JSON's numbers: every one with a unit is one of them, rounded to the digits shown. Of these pages what is
// said is all read from the JSON; others count or divide.
const saidByJson = ['thermal', 'screen', 'split', 'assess', 'cross', 'table', 'iso230', 'circle', 'calibrate', 'batch'];
async function verdictSaysJson(page, name) {
  if (!saidByJson.includes(name)) return 0;
  const numbers = [];
  const collect = (v) => (typeof v === 'number' ? numbers.push(v) : v && typeof v === 'object' && Object.values(v).forEach(collect));
  collect(JSON.parse(readFileSync(`${name}.json`, 'utf8')));
  const said = [...(await page.textContent('#verdict')).matchAll(/(-?\d+(?:\.(\d+))?) (µm|µrad|%)/g)];
  for (const [text, number, digits] of said) {
    const step = 10 ** -(digits ?? '').length * (digits ? 1 : 10 ** Math.max(0, number.replace('-', '').length - 3));
    assert.ok(numbers.some((n) => [n, 1000 * n, 100 * n].some((v) => Math.abs(v - Number(number)) <= 0.5001 * step)),
              `${name}: the verdict says ${text}, the JSON does not`);
  }
  assert.ok(said.length > 0, `${name}: the verdict gives no figure`);
  return said.length;
}

// Tables that A4 within its margins would cut, with their widths.
async function widerThanPaper(page) {
  const screen = page.viewportSize();
  await page.setViewportSize({width: 718, height: screen.height});
  await page.emulateMedia({media: 'print'});
  const out = await page.$$eval('table', (all) => all.filter((t) => t.scrollWidth > t.parentElement.clientWidth).map((t) => [t.closest('figure').id, t.scrollWidth]));
  await page.emulateMedia({media: null});
  await page.setViewportSize(screen);
  return out;
}

async function activateAll(page) {
  const count = await page.$$eval('figure[data-figure]', (all) => all.length);
  for (let i = 0; i < count; i++) {
    await page.evaluate((k) => document.querySelectorAll('figure[data-figure]')[k].scrollIntoView(), i);
    await page.waitForTimeout(250);
  }
  await page.evaluate(() => scrollTo(0, 0));
  return count;
}

// Processor seconds of every living process of this browser, by its number. What a process that ended meanwhile had spent is not in it.
function processorSeconds() {
  const table = new Map();
  for (const pid of readdirSync('/proc').filter((n) => /^\d+$/.test(n))) {
    try {
      const stat = readFileSync(`/proc/${pid}/stat`, 'utf8');
      const fields = stat.slice(stat.lastIndexOf(')') + 2).split(' ');
      table.set(Number(pid), {parent: Number(fields[1]), seconds: (Number(fields[11]) + Number(fields[12])) / 100});
    } catch {
      // gone meanwhile
    }
  }
  const ours = (pid) => pid === process.pid || (table.has(pid) && ours(table.get(pid).parent));
  return new Map([...table].filter(([pid]) => pid !== process.pid && ours(pid)).map(([pid, {seconds}]) => [pid, seconds]));
}

// What they spent since `before`: what waiting would come to on an idle machine, at the most.
function spentSince(before) {
  let seconds = 0;
  for (const [pid, now] of processorSeconds()) seconds += now - (before.get(pid) ?? 0);
  return seconds;
}

// The pictures of README.md, and nothing else: `PICTURES=folder`.
if (process.env.PICTURES) {
  for (const [name, section] of [['post', '#scene'], ['compare', '#scene'], ['diagnose', '#section-3'], ['improve', '#section-2'], ['thermal', 'main'], ['compensated', '#scene']]) {
    const {page} = await open(name);
    await activateAll(page);
    await page.evaluate((at) => document.querySelector(at).scrollIntoView(), section);
    if (section === 'main') await page.evaluate(() => scrollTo(0, 0));
    await page.waitForTimeout(5000);  // a scene is drawn a while after it is made
    await page.screenshot({path: `${process.env.PICTURES}/${name}.png`, timeout: 120000});
    await page.close();
  }
  await browser.close();
  process.exit(0);
}

// From opening the file until the page takes input, and until its slider has moved the machine; pages in turn, the best of three rounds, since
// other work only adds time. The processor time of all processes is what waiting would come to on an idle machine, at the most.
async function timed(...names) {
  const best = names.map(() => ({seconds: Infinity, processor: Infinity, moved: Infinity, movedProcessor: Infinity}));
  for (let round = 0; round < 3; round++) {
    for (const [i, name] of names.entries()) {
      const keep = (key, value) => { best[i][key] = Math.min(best[i][key], value); };
      const before = processorSeconds();
      const start = Date.now();
      const {page, troubles, seconds} = await open(name);
      keep('processor', spentSince(before));
      keep('seconds', seconds);
      await page.evaluate(async () => {
        await trunnionScene();
        const slider = document.getElementById('stop');
        slider.value = Number(slider.max) / 2;
        slider.dispatchEvent(new Event('input'));
      });
      await page.waitForFunction(() => /NC line \d+/.test(document.getElementById('stop-text').textContent));
      keep('moved', (Date.now() - start) / 1000);
      keep('movedProcessor', spentSince(before));
      assert.deepEqual(troubles, []);
      await page.close();
    }
  }
  return names.map((name, i) => {
    const {seconds, processor, moved, movedProcessor} = best[i];
    const blocks = JSON.parse(readFileSync(`${name}.json`, 'utf8')).blocks;
    const megabytes = statSync(`${name}.html`).size / 1e6;
    console.log(`${name}: ${blocks} blocks, ${megabytes.toFixed(2)} MB, takes input after ${seconds.toFixed(2)} s, the slider has moved the machine after ` +
                `${moved.toFixed(2)} s (${processor.toFixed(2)} and ${movedProcessor.toFixed(2)} s of processor time in all processes; load ${loadavg()[0].toFixed(1)})`);
    return {blocks, megabytes, seconds};
  });
}

// The time of one page, and nothing else: `TIMED=name`.
if (process.env.TIMED) {
  await timed(process.env.TIMED);
  await browser.close();
  process.exit(0);
}

// axe-core: no serious fault of accessibility, in the light and in the dark.
const axe = readFileSync('node_modules/axe-core/axe.min.js', 'utf8');
async function isAccessible(page, name) {
  await page.evaluate(() => globalThis.trunnionScene());
  await page.evaluate(axe);  // by the driver: the page's own policy lets nothing in
  for (const colorScheme of ['light', 'dark']) {
    await page.emulateMedia({colorScheme});
    await page.waitForTimeout(100);
    const faults = await page.evaluate(async () => (await axe.run(document, {resultTypes: ['violations']})).violations
      .filter((v) => v.impact === 'serious' || v.impact === 'critical').map((v) => `${v.id}: ${v.nodes[0].html.slice(0, 200)}`));
    assert.deepEqual(faults, [], `${name}, ${colorScheme}`);
  }
}

const interactive = /id="charts">./.test(readFileSync('post.html', 'utf8'));
const names = ['post', 'compensated', 'plain', 'verify', 'compare', 'evaluate', 'diagnose', 'history', 'improve', 'simulate', 'iso230', 'thermal', 'predict', 'study', 'table', 'fit', 'machine', 'batch',
  'screen', 'split', 'assess', 'cross', 'plan', 'calibrate', 'probe', 'circle', 'limits', 'check', 'log', 'template', 'effects', 'tables'];
// Of the pages of one kind the first is looked at in the dark, too: the style sheet is the same for all.
for (const name of ['post', 'diagnose', 'predict']) {
  const {page, troubles} = await open(name, 'dark');
  await activateAll(page);
  await page.screenshot({path: `${name}-dark.png`, fullPage: true, timeout: 120000});
  assert.deepEqual(troubles, [], name);
  await page.close();
}

// Every page: what it shows is its JSON's, nothing is wider than the window, no serious fault of accessibility. And nothing leaves it: every
// button is pressed, those of the charts' toolbars among them; no request goes out, no other page or download opens, and the address stays.
// The toolbars hold the buttons of this list only.
const toolbar = ['Zoom', 'Pan', 'Zoom in', 'Zoom out', 'Autoscale', 'Reset axes', 'Orbital rotation', 'Turntable rotation', 'Reset camera to default'];
const leastFacts = {post: 4, compensated: 4, plain: 4, verify: 4, evaluate: 4, diagnose: 4, fit: 3, batch: 4, simulate: 1, calibrate: 2, cross: 3};
let pressed = 0;
for (const name of names) {
  const {page, troubles} = await open(name);
  const opened = [];
  page.on('popup', (p) => opened.push(`popup: ${p.url()}`));
  page.on('download', (d) => opened.push(`download: ${d.url()}`));
  page.on('framenavigated', (f) => opened.push(`navigation: ${f.url()}`));
  page.on('dialog', (d) => (opened.push(`dialog: ${d.message()}`), d.dismiss()));
  const compared = await factsEqualJson(page, name);
  assert.ok(compared >= (leastFacts[name] ?? 0), `${name}: only ${compared} facts compared`);
  const shown = await tablesShowJson(page, name) + await verdictSaysJson(page, name);
  assert.deepEqual(await widerThanPaper(page), [], `${name}: tables that paper cuts`);
  const drawn = await activateAll(page);
  assert.ok(drawn + (await page.$$eval('td, .scene, pre', (all) => all.length)) >= 1, `${name}: nothing to see`);
  const overflow = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  assert.ok(overflow <= 0, `${name}: ${overflow} px wider than the window`);
  await page.screenshot({path: `${name}-light.png`, fullPage: true, timeout: 120000});
  await isAccessible(page, name);
  const titles = await page.$$eval('.modebar-btn', (all) => all.map((b) => b.dataset.title));
  assert.deepEqual(titles.filter((t) => !toolbar.includes(t)), [], `${name}: a button that is not on the list`);
  assert.deepEqual(await page.$$eval('a, area, form, iframe, object, embed', (all) => all.map((e) => e.getAttribute('href') ?? e.tagName)
    .filter((t) => !t.startsWith('#'))), [], `${name}: a link that leaves the page`);
  // Pressed by the page itself: a toolbar is hidden until the pointer stands on its chart, and one button may cover another.
  pressed += await page.evaluate(async () => {
    const all = [...document.querySelectorAll('.modebar-btn, button')];
    for (const b of all) {
      b.dispatchEvent(new MouseEvent('click', {bubbles: true}));
      await new Promise((done) => setTimeout(done, 20));
    }
    return all.length;
  });
  await page.waitForTimeout(300);
  assert.equal(await page.$('.plotly-cloud-dialog'), null, `${name}: a dialog that offers to send`);
  assert.equal(await page.evaluate(() => window.open('https://example.invalid/')), null);
  assert.deepEqual([...opened, ...troubles], [], `${name}: something left the page`);
  console.log(`${name}: ${drawn} figures, ${compared} facts and ${shown} other numbers equal to the JSON`);
  await page.close();
}
console.log(`nothing leaves the pages: ${pressed} buttons pressed on ${names.length} pages, no request, no other page`);

{  // The policy of a page stops what its scripts would send, whatever they are.
  const {page} = await open('machine');
  const reached = [];
  await page.route(/^https?:/, (route) => (reached.push(route.request().url()), route.abort()));
  const stopped = await page.evaluate(async () => {
    const seen = [];
    document.addEventListener('securitypolicyviolation', (e) => seen.push(e.effectiveDirective));
    await fetch('https://example.invalid/').catch(() => {});
    navigator.sendBeacon('https://example.invalid/', 'x');
    for (const [tag, key] of [['img', 'src'], ['script', 'src'], ['iframe', 'src'], ['link', 'href'], ['form', 'action']]) {
      const element = document.createElement(tag);
      element.rel = 'stylesheet';
      element[key] = 'https://example.invalid/';
      document.body.append(element);
      if (tag === 'form') element.submit();
    }
    // A busy machine tells of the last one late.
    for (let waited = 0; !seen.includes('form-action') && waited < 20000; waited += 100) await new Promise((done) => setTimeout(done, 100));
    return seen;
  });
  for (const directive of ['connect-src', 'img-src', 'script-src-elem', 'frame-src', 'style-src-elem', 'form-action'])
    assert.ok(stopped.includes(directive), `${directive} does not stop it: ${stopped}`);
  assert.deepEqual(reached, []);
  await page.close();
}

{  // On paper the drawings stand, not the charts; of the scene the picture as it was shown.
  const {page} = await open('post');
  const figures = await page.$$eval('figure[data-figure], figure.scene', (all) => all.length);
  const shown = () => page.$$eval('.still, .printed', (all) => all.filter((e) => getComputedStyle(e).display !== 'none').map((e) => e.className));
  await page.evaluate(() => trunnionScene());
  await page.emulateMedia({media: 'print'});
  await page.waitForFunction(() => document.querySelector('.has-print'));
  assert.equal((await shown()).length, figures);
  assert.ok((await shown()).includes('printed'));
  assert.ok((await page.$eval('.printed img', (e) => e.src.length)) > 5000, 'the picture is not empty');
  await page.screenshot({path: 'post-print.png', fullPage: true, timeout: 120000});
  await page.close();
}

// A narrow window: nothing is wider than it, and the buttons can be pressed.
for (const name of ['post', 'compensated', 'compare', 'plan', 'machine', 'improve', 'thermal', 'circle']) {
  const {page, troubles} = await open(name);
  await page.setViewportSize({width: 420, height: 800});
  await page.evaluate(() => trunnionScene());
  const overflow = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  assert.ok(overflow <= 0, `${name}: ${overflow} px wider than 420`);
  await page.screenshot({path: `${name}-420.png`, fullPage: true, timeout: 120000});
  assert.deepEqual(troubles, [], name);
  await page.close();
}

{  // Without WebGL: the still picture and a sentence instead of an empty box.
  const blind = await chromium.launch({executablePath: process.env.CHROMIUM, args: ['--no-sandbox', '--disable-quic', '--no-first-run', '--disable-3d-apis', '--disable-gpu']});
  for (const [name, figure] of [['post', '#scene'], ['machine', '#scene'], ['diagnose', '#vectors-before']]) {
    const page = await blind.newPage({viewport: {width: 1280, height: 720}});
    const troubles = [];
    page.on('pageerror', (e) => troubles.push(e.message));
    await page.goto(`file://${resolve(`${name}.html`)}`);
    await page.evaluate((at) => document.querySelector(at).scrollIntoView(), figure);
    await page.waitForSelector(`${figure} .why-still`);
    assert.match(await page.textContent(`${figure} .why-still`), /still picture/);
    assert.ok(await page.isVisible(`${figure} .still svg`), `${name}: a still picture`);
    assert.deepEqual(troubles, [], name);
    await page.close();
  }
  await blind.close();
}

// A story shows one step at a time, by its buttons and by the links; paper shows all.
for (const name of ['improve', 'history']) {
  const {page, troubles} = await open(name);
  const steps = JSON.parse(readFileSync(`${name}.json`, 'utf8')).steps;
  const shown = () => page.$$eval('.story > section', (all) => all.map((s) => getComputedStyle(s).display !== 'none'));
  assert.deepEqual(await shown(), steps.map((_, i) => i === 0), `${name}: the first step`);
  await page.getByRole('button', {name: 'next step'}).focus();
  await page.keyboard.press('Enter');
  assert.deepEqual(await shown(), steps.map((_, i) => i === 1), `${name}: the second step`);
  if (name === 'improve') assert.ok((await page.textContent('.story > section:nth-of-type(2)')).includes(steps[1].paragraph), 'the sentence of the step');
  await page.emulateMedia({media: 'print'});
  assert.deepEqual(await shown(), steps.map(() => true), `${name}: on paper`);
  assert.deepEqual(troubles, []);
  await page.close();
}

// The scene of a program: what it shows is the JSON's, and path, text, slider and buttons move one machine.
{
  const {page, troubles} = await open('post');
  const json = JSON.parse(readFileSync('post.json', 'utf8'));
  const nc = readFileSync('post.nc', 'utf8').split('\n');
  const cl = readFileSync('impeller.cls', 'utf8').split('\n');
  await activateAll(page);
  await page.evaluate(async () => { globalThis.s = await trunnionScene(); });
  const here = () => page.evaluate(() => ({block: s.state.block, nc: s.columns.nc_line[s.state.block], cl: s.columns.cl_line[s.state.block], q: s.state.q, tip: s.tipInPart(s.state.block)}));
  const said = () => page.textContent('#stop-text');

  // The page's own kinematics puts the tip where the verification has it, and opens at the worst place.
  const worst = (json.verification ?? json).worst;
  const first = await here();
  assert.equal(first.nc, worst[0].nc_line);
  assert.ok((await said()).includes(`NC line ${worst[0].nc_line}${nc[worst[0].nc_line - 1]}`), await said());
  assert.ok((await said()).includes(`CL line ${worst[0].cl_line}${cl[worst[0].cl_line - 1].trim()}`), await said());
  for (const [i, button] of (await page.$$('#worst button')).entries()) {
    await button.click();
    await page.waitForFunction((line) => s.columns.nc_line[s.state.block] === line, worst[i].nc_line);
    const at = await here();
    assert.ok(Math.hypot(...at.tip.map((v, k) => v - worst[i].tip_mm[k])) < 2e-3, `tip at NC line ${at.nc}: ${at.tip}, JSON ${worst[i].tip_mm}`);
    assert.equal(await page.textContent('.line.chosen'), `${String(at.nc).padStart(String(nc.length).length)}${nc[at.nc - 1]}`);
  }
  // Hover and click on the path: its block, in the tip and in the text.
  await page.click('text=whole view');
  await page.locator('#scene canvas').scrollIntoViewIfNeeded();
  const aim = await page.evaluate(() => {
    s.drawNow();
    const frame = document.querySelector('#scene canvas').getBoundingClientRect();
    const block = Math.floor(s.columns.nc_line.length / 2);
    const [x, y] = s.onScreen(s.tipInPart(block));
    return {x: frame.left + x, y: frame.top + y};
  });
  await page.mouse.move(aim.x, aim.y);
  const tip = await page.textContent('.tip');
  const [, line] = /^NC line (\d+): /.exec(tip);
  assert.ok(tip.includes(nc[line - 1]) && /CL line \d+/.test(tip), tip);
  await page.mouse.click(aim.x, aim.y);
  assert.equal((await here()).nc, Number(line));
  assert.ok((await page.textContent('.line.chosen')).endsWith(nc[line - 1]));
  // A click in the text moves the machine; arrow keys go on from there.
  await page.evaluate(() => document.querySelector('.line.chosen').nextElementSibling.nextElementSibling.click());
  const clicked = await here();
  assert.ok(clicked.nc > Number(line) && clicked.nc <= Number(line) + 2);
  await page.focus('.program');
  await page.keyboard.press('ArrowDown');
  const below = await here();
  assert.ok(below.block === clicked.block + 1, 'a key in the text');
  assert.notDeepEqual(below.q, clicked.q, 'the machine moves');
  // Keys on the picture: step, play, stop.
  await page.focus('#scene canvas');
  await page.keyboard.press('.');
  assert.equal((await here()).block, below.block + 1);
  await page.keyboard.press(',');
  assert.equal((await here()).block, below.block);
  await page.keyboard.press('Space');
  await page.waitForFunction((b) => s.state.block > b, below.block);
  await page.keyboard.press('Space');
  assert.equal(await page.evaluate(() => s.state.playing), false);
  const [yaw, pan] = await page.evaluate(() => [s.state.yaw, s.state.pan[0]]);
  await page.keyboard.press('Shift+ArrowRight');
  assert.ok(await page.evaluate(([a, b]) => s.state.yaw === a && s.state.pan[0] > b, [yaw, pan]), 'with shift the arrows move the picture');
  await page.focus('#stop');
  await page.keyboard.press('Home');
  assert.equal((await here()).block, 0);
  assert.match(await page.getAttribute('#stop', 'aria-valuetext'), /^NC line \d+/);
  // Linking moves are off; a swipe puts two colours beside each other on one scale, with one camera.
  assert.equal(await page.evaluate(() => s.state.links), false);
  assert.ok(await page.evaluate(() => s.cut.triangles.length / 3) > 5000, 'rows are stretched to a surface');
  const choices = await page.$$eval('select.beside option', (all) => all.map((o) => o.textContent));
  await page.selectOption('select.beside', {label: 'error without inserted points'});
  const legends = await page.$$eval('.most', (all) => all.map((e) => e.textContent));
  const largest = Number((1000 * json.worst_predicted_mm).toPrecision(4));
  assert.ok(legends.length === 2 && legends[0] === legends[1], `${legends}`);
  assert.ok(Math.abs(parseFloat(legends[1]) / largest - 1) < 0.02, `the legend says ${legends[1]}, the post predicted ${largest} µm`);
  await page.focus('.swipe');
  await page.keyboard.press('Home');
  assert.equal(await page.evaluate(() => s.state.swipe), 0);
  assert.deepEqual(troubles, []);
  await page.close();
  const compensated = await open('compensated');
  await compensated.page.evaluate(() => trunnionScene());
  const more = await compensated.page.$$eval('select.beside option', (all) => all.map((o) => o.textContent));
  assert.ok(more.includes('machine error before compensation') && !choices.includes('machine error before compensation'), `${more}`);
  assert.ok(more.includes('tip deviation on the machine with its errors'), `${more}`);
  // It opens with after on the left and before on the right, at the worst place, and its sentence says both.
  const [{nc_line, tip_deviation_mm}] = JSON.parse(readFileSync('compensated.json', 'utf8')).worst;
  const [left, right, before, largest_um] = await compensated.page.evaluate(async () => {
    const t = await trunnionScene();
    const column = t.columns.machine_um;
    return [t.source.colourings[t.state.colour].column, t.source.colourings[t.state.other].column, column[t.state.block], column.reduce((a, b) => Math.max(a, b))];
  });
  assert.deepEqual([left, right], ['tip_um', 'machine_um']);
  const sentence = await compensated.page.textContent('#verdict');
  const short = (v) => String(Number(v.toPrecision(3)));
  assert.ok(sentence.includes(`Worst at NC line ${nc_line} (CL line`) && sentence.includes(`: ${Number((1000 * tip_deviation_mm).toPrecision(4))} µm.`), sentence);
  assert.ok(sentence.includes(`up to ${short(largest_um)} µm, by ${short(before)} µm at the worst place`), sentence);
  await compensated.page.close();
  console.log(`scene: ${worst.length} worst places, hover, click, text, keys, play and swipe agree with the JSON and the program`);
}

{  // Two programs on one part: the colours right of the border are the other program's, on one scale.
  const {page, troubles} = await open('compare');
  const programs = JSON.parse(readFileSync('compare.json', 'utf8')).programs;
  await page.evaluate(async () => { globalThis.s = await trunnionScene(); });
  const said = await page.$$eval('.scale', (all) => all.map((e) => e.textContent));
  const largest = Number((1000 * Math.max(...programs.map((p) => p.max_tip_deviation_mm))).toPrecision(4));
  assert.equal(said.length, 2);
  programs.forEach((p, i) => assert.ok(said[i].startsWith(`tip deviation, ${p.file}`) && said[i].includes(`${largest} µm`), `${said[i]}, ${largest}`));
  // Of every program the largest colour is the largest of its blocks.
  const most = await page.evaluate(() => s.source.colourings.slice(0, 2).map((c) => s.columns[c.column].reduce((a, b) => Math.max(a, b), 0)));
  programs.forEach((p, i) => assert.ok(Math.abs(most[i] - 1000 * p.max_tip_deviation_mm) < 2e-3, `${p.file}: ${most[i]}`));
  // One program hides the other: the scale has three decades, until the reader wants it even.
  assert.ok(said[0].includes(`: ${Number((largest / 1000).toPrecision(4))}`), `three decades: ${said[0]}`);
  await page.getByRole('checkbox', {name: 'logarithmic'}).uncheck();
  assert.ok((await page.textContent('.scale')).includes(': 0'), 'an even scale begins at 0');
  assert.deepEqual(troubles, []);
  await page.close();
}

{  // The poses of a plan on the machine: the list and the keys move it, and the positions are those of the plan.
  const {page, troubles} = await open('plan');
  const [run] = JSON.parse(readFileSync('plan.json', 'utf8')).runs;
  await page.evaluate(async () => { globalThis.s = await trunnionScene(); });
  const at = () => page.evaluate(() => Object.fromEntries(s.source.axes.map((a, k) => [a.name, s.state.q[k]])));
  const first = await at();
  if (run.poses) for (const axis of ['A', 'C']) assert.ok(Math.abs(first[axis] - (run.poses[0][`${axis}_deg`] ?? 0)) < 1e-6, `${axis} ${first[axis]}`);
  await page.focus('.program');
  await page.keyboard.press('ArrowDown');
  assert.notDeepEqual(await at(), first, 'the machine moves');
  assert.equal(await page.textContent('.line.chosen'), `${String(2).padStart(String(await page.evaluate(() => s.source.stands.length)).length)}${await page.evaluate(() => s.source.stands[1].text)}`);
  await page.focus('#scene canvas');
  await page.keyboard.press(',');
  assert.deepEqual(await at(), first);
  assert.deepEqual(troubles, []);
  await page.close();
}

{  // Limits: the page says what the JSON says, and is no longer neutral.
  const {page, troubles} = await open('limits');
  const json = JSON.parse(readFileSync('limits.json', 'utf8'));
  assert.equal(json.passed, false);
  const beyond = json.limits.filter((l) => l.result === 'beyond');
  assert.ok(beyond.length > 0);
  for (const l of beyond) assert.ok((await page.textContent('#verdict')).includes(`${l.of} ${l.symbol}`), l.symbol);
  assert.ok(await page.$('#verdict.bad'));
  const rows = await page.$$eval('#limits tbody tr', (all) => all.map((r) => r.children[1].textContent));
  assert.deepEqual(rows, json.limits.map((l) => l.result));
  assert.deepEqual(troubles, []);
  await page.close();
}

// The machine moved by hand: each body goes the way that the words say, by the page's own kinematics.
{
  const {page, troubles} = await open('machine');
  const axes = JSON.parse(readFileSync('machine.json', 'utf8')).axes;
  // The scene draws with the next frame, which a busy machine may show late.
  await page.evaluate(async () => { globalThis.s = await trunnionScene(); s.drawNow(); });
  // It stands with its tool clear above the part's zero.
  assert.ok(await page.evaluate(() => kinematics.tipInPart(s.source, s.state.q)[2] > 10), 'the tool is clear of the table');
  assert.deepEqual(await page.$$eval('.mark', (all) => all.map((e) => e.textContent)), axes.map((a) => `+${a.name}`));
  for (const axis of axes) {
    assert.equal(await page.textContent(`label[for=jog-${axis.name}]`), `+${axis.name}: ${axis.motion}`);
    await page.focus(`#jog-${axis.name}`);
    await page.keyboard.press('ArrowRight');
    assert.ok(await page.evaluate((name) => s.state.q[s.source.axes.findIndex((a) => a.name === name)] > 0, axis.name), axis.name);
  }
  // On paper the arrows stand where they stood on the screen.
  const places = () => page.$$eval('.mark', (all) => all.slice(-5).map((e) => [e.getAttribute('x'), e.getAttribute('y')]));
  await page.evaluate(() => s.drawNow());  // the last key is drawn with the next frame
  const onScreen = await places();
  await page.emulateMedia({media: 'print'});
  await page.waitForFunction(() => document.querySelector('.printed .mark'));
  assert.deepEqual(await places(), onScreen);
  assert.deepEqual(troubles, []);
  await page.close();
}

{
  const [small, large] = await timed('post', 'large');
  assert.ok(large.megabytes < 8, 'a page stays under 8 MB');
  // How long a page takes depends on the machine and on what else it does; that a long program's page takes hardly longer than a short one's does
  // not. On two processors the ratio is 0.8 to 1.8, loaded or not, for eleven times the blocks.
  assert.ok(large.blocks > 10 * small.blocks);
  assert.ok(large.seconds < 3 * small.seconds, `${large.blocks / small.blocks} times the blocks: interactive within 3 times the time`);
}
await browser.close();
