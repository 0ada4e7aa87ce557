// The scene of a page: the machine as solids, the part with its path and surface, the program beside it, and what moves them.
const scene = (() => {
  'use strict';
  const {css, data, make, short, places} = core;
  const {product, inverse, moved, carried, identity} = kinematics;
  const kDecades = 3;    // of a logarithmic colour scale
  const kNear_px = 12;  // a path nearer than this to the pointer is meant
  const bodyColour = {bed: '#8b939c', slide: '#a3abb4', cradle: '#7f95ad', table: '#b9a27c', spindle: '#6f7780', holder: '#4c5259', tool: '#c9ced4', flute: '#d55e00', ball: '#d55e00'};

  async function start(figure, hooks) {
    const source = data('scene');
    const stage = figure.querySelector('.stage');
    const canvas = make('canvas', {tabIndex: 0, role: 'img'});
    const gl = core.canUnpack ? gl3.create(canvas) : null;
    if (!gl) return null;
    const columns = {};
    for (const c of source.columns) columns[c.name] = await core.unpackedColumn(c);
    const count = source.columns.length ? source.columns[0].count : 0;
    const hasProgram = count > 0;
    const stands = source.stands ?? [];
    let standShown = () => {};
    const q = (block) => source.axes.map((a) => columns[a.name][block]);
    const state = {
      block: 0, q: hasProgram ? q(0) : [...(source.start ?? source.axes.map(() => 0))], view: hasProgram ? 'part' : 'machine', links: false, machine: !hasProgram, surface: true,
      arrows: !hasProgram && !stands.length, colour: 0, other: source.beside ?? -1, swipe: 0.5, oneScale: true, log: false, playing: false, speed: 10, yaw: -0.9, pitch: 0.55, zoom: 1, pan: [0, 0],
    };

    // Rows: right, up, towards the eye.
    function axesOfView() {
      const [sy, cy, sp, cp] = [Math.sin(state.yaw), Math.cos(state.yaw), Math.sin(state.pitch), Math.cos(state.pitch)];
      return [[cy, sy, 0], [-sp * sy, sp * cy, cp], [cp * sy, -cp * cy, sp]];
    }

    // ---- what is drawn
    const bodies = [];
    for (const b of source.bodies) {
      const [x, y, z] = await Promise.all(b.corners.map(core.unpackedColumn));
      const corners = new Float32Array(3 * x.length);
      for (let i = 0; i < x.length; i++) corners.set([x[i], y[i], z[i]], 3 * i);
      const ends = [x, y, z].map((v) => [v.reduce((a, c) => Math.min(a, c), Infinity), v.reduce((a, c) => Math.max(a, c), -Infinity)]);
      bodies.push({...b, ends, corners: gl.corners(corners), count: x.length, colour: bodyColour[b.role] ?? '#888888'});
    }
    const points = new Float32Array(3 * count);
    for (let i = 0; i < count; i++) points.set(kinematics.tipInPart(source, q(i)), 3 * i);
    const cut = hasProgram ? surface.of(points, columns.rapid) : null;
    const path = cut && {corners: gl.corners(points), triangles: gl.indices(cut.triangles), rows: gl.indices(cut.rows), links: gl.indices(cut.links)};
    const colourings = source.colourings;
    // Where one of two hides the other a logarithmic scale shows both.
    if (state.other >= 0) {
      const [a, b] = [colourings[state.colour].largest, colourings[state.other].largest];
      state.log = Math.max(a, b) > 10 * Math.min(a, b);
    }
    // Where two are compared in one unit one scale tells them apart; else each has its own.
    function scaleOf(k) {
      const other = state.other;
      const own = colourings[k].largest || 1;
      const shared = state.oneScale && other >= 0 && colourings[other].unit === colourings[state.colour].unit;
      return shared ? Math.max(colourings[other].largest, colourings[state.colour].largest) || 1 : own;
    }
    const buffers = new Map();
    function valuesOf(k) {
      const key = `${k}/${scaleOf(k)}/${state.log}`;
      if (!buffers.has(key)) {
        const largest = scaleOf(k);
        const share = state.log ? (v) => Math.max(0, 1 + Math.log10(v / largest) / kDecades) : (v) => v / largest;
        buffers.set(key, gl.corners(Float32Array.from(columns[colourings[k].column], share)));
      }
      return buffers.get(key);
    }

    // The middle and size, across the first view, of the machine wherever it is sent.
    function machineBounds() {
      const rows = axesOfView();
      const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
      for (const place of stands.length ? stands.map((s) => s.q) : [state.q]) {
        for (const b of bodies) {
          const pose = carried(source, b.part_side, Math.min(b.axes, (b.part_side ? source.part_chain : source.tool_chain).length), place);
          for (let k = 0; k < 8; k++) {
            const p = moved(pose, b.ends.map((e, i) => e[(k >> i) & 1]));
            rows.forEach((row, r) => {
              const at = row.reduce((sum, v, i) => sum + v * p[i], 0);
              low[r] = Math.min(low[r], at), high[r] = Math.max(high[r], at);
            });
          }
        }
      }
      const middle = [0, 1, 2].map((k) => rows.reduce((sum, row, r) => sum + row[k] * (low[r] + high[r]) / 2, 0));
      return {middle, size: 0.52 * Math.max(high[0] - low[0], high[1] - low[1])};
    }

    // The middle and size of what is looked at.
    const bounds = (() => {
      if (!hasProgram) return machineBounds();
      const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
      for (const i of cut.rows.length ? cut.rows : cut.links) {
        for (let k = 0; k < 3; k++) low[k] = Math.min(low[k], points[3 * i + k]), high[k] = Math.max(high[k], points[3 * i + k]);
      }
      return {middle: low.map((v, k) => (v + high[k]) / 2), size: Math.max(1, 0.5 * Math.hypot(...low.map((v, k) => high[k] - v)))};
    })();

    // ---- the camera: parallel, turned by yaw and pitch
    let camera = identity();
    let world = identity();  // machine axes, or the part's, into what the camera sees
    let shownSize = [1, 1];  // of the canvas when it was last on the screen: on paper it is hidden
    function look() {
      if (canvas.clientWidth) shownSize = [canvas.clientWidth, canvas.clientHeight];
      const part = kinematics.part(source, state.q);
      world = state.view === 'part' ? inverse(part) : identity();
      const middle = state.view === 'part' ? bounds.middle : hasProgram ? moved(part, bounds.middle) : bounds.middle;
      const size = (state.view === 'machine' && hasProgram ? 2.4 * source.size : bounds.size) / state.zoom;
      const [width, height] = shownSize;
      const unit = Math.min(width, height) / (2 * size);  // pixels a millimetre
      const rows = axesOfView();
      const scale = [2 * unit / width, 2 * unit / height, -1 / (40 * Math.max(size, source.size))];
      camera = identity();
      rows.forEach((row, r) => {
        row.forEach((v, c) => { camera[4 * c + r] = scale[r] * v; });
        camera[12 + r] = -scale[r] * row.reduce((sum, v, k) => sum + v * middle[k], 0) + (r < 2 ? state.pan[r] : 0);
      });
      return {aspect: scale.map((v) => 1 / v), rows};
    }
    function onScreen(p) {
      const [x, y] = moved(camera, p);
      return [(x + 1) / 2 * shownSize[0], (1 - y) / 2 * shownSize[1]];
    }

    let asked = false;
    function draw() {
      if (asked) return;
      asked = true;
      requestAnimationFrame(() => { asked = false; drawNow(); });
    }
    function drawNow(paper = css('--paper')) {
      if (!canvas.clientWidth && !canvas.width) return;
      const {aspect} = look();
      gl.colours(places());
      gl.begin(camera, aspect, paper);
      const part = product(world, kinematics.part(source, state.q));
      for (const body of bodies) {
        const always = hasProgram && ['tool', 'flute', 'holder'].includes(body.role);
        if (!state.machine && !always) continue;
        const chain = body.part_side ? source.part_chain.length : source.tool_chain.length;
        gl.draw(body, product(world, carried(source, body.part_side, Math.min(body.axes, chain), state.q)));
      }
      if (path) {
        const sides = state.other >= 0 ? [[state.colour, 0, state.swipe], [state.other, state.swipe, 1]] : [[state.colour, 0, 1]];
        for (const [k, from, to] of sides) {
          if (state.other >= 0) gl.between(from, to);
          const values = valuesOf(k);
          if (state.surface && path.triangles.count) gl.draw({corners: path.corners, values, indices: path.triangles}, part);
          gl.draw({corners: path.corners, values, indices: path.rows, lines: true}, part);
        }
        if (state.other >= 0) gl.between(0, 1);
        if (state.links) gl.draw({corners: path.corners, colour: '#8c959f', indices: path.links, lines: true}, part);
      }
      arrows();
    }

    // ---- arrows for + of each axis, with its name
    const marks = make('div', {className: 'marks', 'aria-hidden': 'true'});
    function arrows() {
      if (!state.arrows) return void marks.replaceChildren();
      const length = 0.55 * source.size;
      const shapes = source.axes.map((axis, k) => {
        const chain = axis.carries_part ? source.part_chain : source.tool_chain;
        const pose = product(world, carried(source, axis.carries_part, chain.indexOf(k) + 1, state.q));
        const from = axis.rotary ? axis.point : axis.carries_part ? source.part : source.spindle;
        const at = (p) => onScreen(moved(pose, p)).map((v) => v.toFixed(1)).join(' ');
        const d = axis.direction;
        if (!axis.rotary) {
          const to = from.map((v, i) => v + length * d[i]);
          return {axis, line: `M${at(from)} L${at(to)}`, label: onScreen(moved(pose, from.map((v, i) => v + 1.18 * length * d[i])))};
        }
        // Three quarters of a turn about the axis, right-hand.
        const across = Math.abs(d[2]) < 0.9 ? [-d[1], d[0], 0] : [0, d[2], -d[1]];
        const norm = Math.hypot(...across);
        const u = across.map((v) => v / norm);
        const v = [d[1] * u[2] - d[2] * u[1], d[2] * u[0] - d[0] * u[2], d[0] * u[1] - d[1] * u[0]];
        const side = 1.55 * source.size;
        const middle = Math.abs(d[2]) < 0.9 ? from.map((p, i) => p + side * d[i]) : from;
        const radius = Math.abs(d[2]) < 0.9 ? 0.4 * source.size : 1.2 * source.size;
        const place = (turn) => middle.map((p, i) => p + radius * (Math.cos(turn) * u[i] + Math.sin(turn) * v[i]));
        const arc = [...Array(25).keys()].map((i) => at(place(i / 24 * 1.5 * Math.PI)));
        return {axis, line: `M${arc.join(' L')}`, label: onScreen(moved(pose, place(1.6 * Math.PI)))};
      });
      const escape = (text) => text.replace(/[<&]/g, '');
      marks.innerHTML = `<svg width="100%" height="100%"><defs><marker id="head" markerWidth="8" markerHeight="8" refX="5" refY="3" orient="auto"><path d="M0 0 L6 3 L0 6 z" fill="var(--bad)"/></marker></defs>${
        shapes.map((s) => `<path d="${s.line}" fill="none" stroke="var(--bad)" stroke-width="2" marker-end="url(#head)"/><text x="${s.label[0].toFixed(1)}" y="${s.label[1].toFixed(1)}" class="mark">+${escape(s.axis.name)}</text>`).join('')}</svg>`;
    }

    // ---- where the machine stands
    const said = make('dl', {className: 'here', id: 'stop-text', 'aria-live': 'polite'});
    const slider = make('input', {type: 'range', id: 'stop', min: 0, max: Math.max(0, count - 1), value: 0, step: 1});
    let text = null;  // the list beside the scene
    let ncLine = () => undefined, clLine = () => undefined;  // texts of a block's lines
    let numberOf = (line) => line + 1;
    let lineOfBlock = (block) => columns.nc_line[block] - 1;
    const positions = () => source.axes.map((a, k) => `${a.name} ${state.q[k].toFixed(4)} ${a.rotary ? '°' : 'mm'}`.replaceAll(' ', '\u00a0')).join('  ');
    const figureOf = (k, block) => `${short(columns[colourings[k].column][block])} ${colourings[k].unit}`;
    function say() {
      const rows = [];
      if (hasProgram) {
        const nc = columns.nc_line[state.block], cl = columns.cl_line[state.block];
        rows.push([`NC line ${nc}`, ncLine(state.block) ?? 'its text is not on this page'], [`CL line ${cl}`, clLine(state.block) ?? '']);
        colourings.forEach((c, k) => rows.push([c.label, columns.rapid[state.block] ? 'rapid' : figureOf(k, state.block)]));
        rows.push(['place', `${short(columns.path_mm[state.block], 6)} mm along the path`]);
      }
      if (stands.length) rows.push(['pose', stands[state.block].text]);
      rows.push(['joint positions', positions()]);
      said.replaceChildren(...rows.map(([name, value]) => make('div', {}, make('dt', {}, name), make('dd', {}, value))));
      if (!hasProgram) return;
      slider.value = state.block;
      slider.setAttribute('aria-valuetext', `NC line ${columns.nc_line[state.block]}, ${figureOf(state.colour, state.block)} ${colourings[state.colour].label}`);
    }
    function moveTo(block, how = {}) {
      state.block = Math.min(Math.max(Math.round(block), 0), count - 1);
      state.q = q(state.block);
      clock = times[state.block];
      if (how.near) {
        state.zoom = 4;
        const p = [points[3 * state.block], points[3 * state.block + 1], points[3 * state.block + 2]];
        state.view = 'part';
        view.value = 'part';
        machineBox.querySelector('input').checked = state.machine = false;
        state.pan = [0, 0];
        look();
        const [x, y] = moved(camera, p);
        state.pan = [-x, -y];
      }
      say();
      text?.show(lineOfBlock(state.block));
      draw();
      hooks.moved?.(source, columns, state.block, how.near);
    }

    // ---- play
    const times = new Float64Array(count);  // end of each block, s
    for (let i = 1; i < count; i++) times[i] = times[i - 1] + Math.max(columns.seconds[i], 1e-3);
    let clock = 0;
    let frame = 0;
    function tick(now) {
      if (!state.playing) return;
      clock = Math.min(clock + Math.min((now - frame) / 1000, 0.1) * state.speed, times[count - 1]);
      frame = now;
      let [low, high] = [0, count - 1];
      while (low < high) {
        const middle = (low + high) >> 1;
        if (times[middle] < clock) low = middle + 1;
        else high = middle;
      }
      const share = low > 0 ? (clock - times[low - 1]) / (times[low] - times[low - 1]) : 1;
      state.block = low;
      const [a, b] = [q(Math.max(low - 1, 0)), q(low)];
      state.q = a.map((v, k) => v + share * (b[k] - v));
      say();
      text?.show(lineOfBlock(low));
      draw();
      if (clock >= times[count - 1]) play(false);
      else requestAnimationFrame(tick);
    }
    const playButton = make('button', {type: 'button', className: 'play'}, '▶ play');
    function play(on) {
      state.playing = on;
      said.setAttribute('aria-live', on ? 'off' : 'polite');
      playButton.textContent = on ? '❚❚ pause' : '▶ play';
      playButton.setAttribute('aria-pressed', String(on));
      if (!on) return;
      if (clock >= times[count - 1]) clock = 0;
      frame = performance.now();
      requestAnimationFrame(tick);
    }
    let worstAt = -1;
    const step = (by) => (play(false), moveTo(state.block + by));
    const worst = () => (play(false), worstAt = (worstAt + 1) % source.worst.length, moveTo(source.worst[worstAt], {near: true}));

    // ---- what the reader moves
    const button = (label, action) => make('button', {type: 'button', onclick: action}, label);
    const choice = (label, options, value, action) => {
      const select = make('select', {onchange: () => action(select.value)}, ...options.map(([v, t]) => make('option', {value: v}, t)));
      select.value = value;
      return [make('label', {className: 'choice'}, `${label} `, select), select];
    };
    const tick_ = (label, on, action) => {
      const box = make('input', {type: 'checkbox', checked: on, onchange: () => (action(box.checked), draw())});
      return make('label', {className: 'choice'}, box, ` ${label}`);
    };
    const [viewLabel, view] = choice('view', [['part', 'the part stands still'], ['machine', 'the machine stands still']], state.view, (v) => {
      state.view = v;
      state.pan = [0, 0];
      state.zoom = 1;
      machineBox.querySelector('input').checked = state.machine = v === 'machine' || !hasProgram;
      draw();
    });
    const machineBox = tick_('machine', state.machine, (on) => { state.machine = on; });
    const zooms = [button('nearer', () => nearer(1.5)), button('farther', () => nearer(1 / 1.5))];
    const whole = button('whole view', () => { state.pan = [0, 0]; state.zoom = 1; draw(); });
    const legend = make('div', {className: 'legend'});
    function tell() {
      const bar = (k) => make('div', {className: 'scale'}, make('span', {}, `${colourings[k].label}: ${state.log ? short(scaleOf(k) / 10 ** kDecades) : 0}`),
        make('span', {className: 'ramp', role: 'img', 'aria-label': 'colours from the smallest to the largest'}), make('span', {className: 'most'}, `${short(scaleOf(k))} ${colourings[k].unit}`));
      legend.replaceChildren(...(hasProgram ? [bar(state.colour), ...(state.other >= 0 ? [bar(state.other)] : [])] : []));
      legend.querySelectorAll('.ramp').forEach((r) => { r.style.background = `linear-gradient(90deg, ${places().join(',')})`; });
      swipe.hidden = swipeLine.hidden = oneScale.hidden = state.other < 0;
      swipeLine.style.left = `${100 * state.swipe}%`;
      canvas.setAttribute('aria-label', hasProgram
        ? `${state.view === 'part' ? 'The part' : 'The machine'}, coloured by ${colourings[state.colour].label}${state.other >= 0 ? ` on the left and ${colourings[state.other].label} on the right` : ''}. Arrow keys turn, with shift they move, plus and minus zoom, space plays, comma and full stop step, w goes to the worst place.`
        : `The machine. Arrow keys turn, with shift they move, plus and minus zoom${stands.length ? ', comma and full stop step from pose to pose' : ''}.`);
    }
    const options = colourings.map((c, k) => [k, c.label]);
    const [colourLabel] = choice('colour', options, 0, (v) => { state.colour = Number(v); tell(); say(); draw(); });
    const [otherLabel, other] = choice('beside', [[-1, 'nothing'], ...options], state.other, (v) => { state.other = Number(v); tell(); draw(); });
    other.classList.add('beside');
    const swipe = make('input', {type: 'range', min: 0, max: 100, value: 50, className: 'swipe', 'aria-label': 'where the left colours end'});
    swipe.addEventListener('input', () => { state.swipe = swipe.value / 100; swipe.setAttribute('aria-valuetext', `${swipe.value} % of the width`); tell(); draw(); });
    const swipeLine = make('div', {className: 'swipe-line'});
    const oneScale = tick_('one scale', true, (on) => { state.oneScale = on; tell(); });
    const logScale = tick_('logarithmic', state.log, (on) => { state.log = on; tell(); });
    const [speedLabel] = choice('speed', [[1, '1 ×'], [10, '10 ×'], [60, '60 ×'], [300, '300 ×']], state.speed, (v) => { state.speed = Number(v); });

    const box = make('div', {className: 'picture'}, canvas, marks, swipeLine, swipe);
    const tip = make('div', {className: 'tip', hidden: true});
    box.append(tip);
    const beside = make('div', {className: 'beside-scene'});
    const controls = make('div', {className: 'controls', role: 'group', 'aria-label': 'What is shown'});
    const row = make('div', {className: 'scene-row'}, box, beside);
    stage.append(row, legend, controls);
    if (hasProgram) {
      controls.append(colourLabel, otherLabel, oneScale, logScale, tick_('surface', true, (on) => { state.surface = on; }),
                      tick_('linking moves', false, (on) => { state.links = on; }), viewLabel, machineBox, tick_('axes', false, (on) => { state.arrows = on; }), ...zooms, whole);
      const drive = make('div', {className: 'controls', role: 'group', 'aria-label': 'Along the program'}, playButton, speedLabel,
                         button('◀ step', () => step(-1)), button('step ▶', () => step(1)), ...(source.worst.length ? [button('worst place', worst)] : []));
      playButton.addEventListener('click', () => play(!state.playing));
      slider.addEventListener('input', () => (play(false), moveTo(Number(slider.value))));
      stage.append(drive, make('p', {className: 'slider'}, make('label', {htmlFor: 'stop'}, 'block'), slider), said);
    } else {
      controls.append(viewLabel, machineBox, tick_('arrows', !stands.length, (on) => { state.arrows = on; }), ...zooms, whole);
      if (stands.length) besideStands();
      else besideSliders();
      stage.append(said);
    }

    // Each axis by hand.
    function besideSliders() {
      source.axes.forEach((axis, k) => {
        const reach = axis.max > axis.min ? [axis.min, axis.max] : axis.rotary ? [-180, 180] : [-source.size, source.size];
        const jog = make('input', {type: 'range', min: reach[0], max: reach[1], step: 'any', value: state.q[k], id: `jog-${axis.name}`});
        const value = make('output', {});
        const tellPlace = () => {
          value.textContent = `${short(state.q[k], 5)} ${axis.rotary ? '°' : 'mm'}`;
          jog.setAttribute('aria-valuetext', value.textContent);
        };
        tellPlace();
        jog.addEventListener('input', () => {
          state.q[k] = Number(jog.value);
          tellPlace();
          say();
          draw();
        });
        beside.append(make('div', {className: 'jog'}, make('label', {htmlFor: jog.id}, `+${axis.name}: ${axis.motion}`), jog, value));
      });
      beside.append(button('all axes to zero', () => {
        state.q = source.axes.map(() => 0);
        beside.querySelectorAll('input').forEach((input) => { input.value = 0; input.dispatchEvent(new Event('input')); });
      }));
    }
    // The poses of a plan, one after the other.
    function besideStands() {
      const list = program.create(stands.map((p) => p.text), 'Poses, in the order of the runs', standAt, (line) => line + 1);
      beside.append(make('h4', {}, 'Poses'), list.box,
                    make('div', {className: 'controls', role: 'group', 'aria-label': 'From pose to pose'}, button('◀ step', () => standAt(state.block - 1)), button('step ▶', () => standAt(state.block + 1))));
      standShown = list.show;
    }
    function standAt(k) {
      state.block = Math.min(Math.max(k, 0), stands.length - 1);
      state.q = stands[state.block].q;
      say();
      standShown(state.block);
      draw();
    }
    if (stands.length) standAt(0);

    // ---- the pointer: turn, shift, come nearer, hover and click
    let held = null;
    canvas.addEventListener('pointerdown', (e) => { held = {x: e.clientX, y: e.clientY, far: 0, shift: e.shiftKey || e.button === 2}; canvas.setPointerCapture(e.pointerId); });
    canvas.addEventListener('contextmenu', (e) => e.preventDefault());
    canvas.addEventListener('pointermove', (e) => {
      if (!held) return hover(e);
      const [dx, dy] = [e.clientX - held.x, e.clientY - held.y];
      held.far += Math.abs(dx) + Math.abs(dy);
      [held.x, held.y] = [e.clientX, e.clientY];
      if (held.shift) state.pan = [state.pan[0] + 2 * dx / canvas.clientWidth, state.pan[1] - 2 * dy / canvas.clientHeight];
      else turn(-dx / 120, dy / 120);
      draw();
    });
    canvas.addEventListener('pointerup', (e) => {
      const clicked = held && held.far < 5;
      held = null;
      if (!clicked) return;
      const block = nearest(e);
      if (block >= 0) play(false), moveTo(block);
    });
    canvas.addEventListener('pointerleave', () => { tip.hidden = true; });
    canvas.addEventListener('wheel', (e) => { if (e.ctrlKey || document.activeElement === canvas) { e.preventDefault(); nearer(Math.exp(-e.deltaY / 400)); } }, {passive: false});
    function turn(yaw, pitch) {
      state.yaw += yaw;
      state.pitch = Math.min(Math.max(state.pitch + pitch, -1.55), 1.55);
    }
    function nearer(by) {
      const zoom = Math.min(Math.max(state.zoom * by, 0.2), 200);
      state.pan = state.pan.map((v) => v * zoom / state.zoom);
      state.zoom = zoom;
      draw();
    }
    // The feed block nearest to the pointer; of those as near the one towards the eye.
    function nearest(e) {
      if (!hasProgram) return -1;
      const frame = canvas.getBoundingClientRect();
      const [px, py] = [e.clientX - frame.left, e.clientY - frame.top];
      look();
      const m = product(camera, product(world, kinematics.part(source, state.q)));
      let best = -1, bestCost = kNear_px * kNear_px;
      for (let i = 0; i < count; i++) {
        if (columns.rapid[i]) continue;
        const [x, y, z] = [points[3 * i], points[3 * i + 1], points[3 * i + 2]];
        const sx = (m[0] * x + m[4] * y + m[8] * z + m[12] + 1) / 2 * frame.width - px;
        const sy = (1 - (m[1] * x + m[5] * y + m[9] * z + m[13])) / 2 * frame.height - py;
        const far = sx * sx + sy * sy;
        if (far > kNear_px * kNear_px) continue;
        const cost = far + 400 * (m[2] * x + m[6] * y + m[10] * z + m[14]);
        if (cost < bestCost) [best, bestCost] = [i, cost];
      }
      return best;
    }
    function hover(e) {
      const block = nearest(e);
      tip.hidden = block < 0;
      if (block < 0) return;
      const frame = canvas.getBoundingClientRect();
      const nc = columns.nc_line[block];
      const withText = (name, line) => (line === undefined ? name : `${name}: ${line}`);
      tip.textContent = `${withText(`NC line ${nc}`, ncLine(block))}\n${withText(`CL line ${columns.cl_line[block]}`, clLine(block))}\n${colourings[state.colour].label} ${figureOf(state.colour, block)}`;
      tip.style.left = `${Math.min(e.clientX - frame.left + 12, Math.max(0, frame.width - 260))}px`;
      tip.style.top = `${e.clientY - frame.top + 16}px`;
    }
    const keys = {
      ArrowLeft: () => turn(-0.12, 0), ArrowRight: () => turn(0.12, 0), ArrowUp: () => turn(0, 0.12), ArrowDown: () => turn(0, -0.12),
      '+': () => nearer(1.25), '=': () => nearer(1.25), '-': () => nearer(0.8), 0: () => whole.click(),
      ...(hasProgram ? {' ': () => play(!state.playing), ',': () => step(-1), '.': () => step(1), Home: () => moveTo(0), End: () => moveTo(count - 1)} : {}),
      ...(source.worst.length ? {w: worst} : {}),
      ...(stands.length ? {',': () => standAt(state.block - 1), '.': () => standAt(state.block + 1)} : {}),
    };
    const shifts = {ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]};
    canvas.addEventListener('keydown', (e) => {
      if (!keys[e.key] || e.ctrlKey || e.metaKey || e.altKey) return;
      e.preventDefault();
      if (e.shiftKey && shifts[e.key]) state.pan = state.pan.map((v, k) => v + shifts[e.key][k]);
      else keys[e.key]();
      draw();
    });

    // ---- the text
    async function readText() {
      if (!hasProgram) return;
      const linesOf = async (file) => (await core.unpackedText(file.lines)).split(/\r?\n/);
      if (source.cl_text) {
        const all = await linesOf(source.cl_text);
        clLine = source.cl_text.of_blocks ? (block) => all[block] : (block) => all[columns.cl_line[block] - 1];
      }
      // A click on a line without a motion goes to the motion before it, a key on to the next one in its direction.
      const blockAt = (line, way) => {
        let [low, high] = [0, count - 1];
        while (low < high) {
          const middle = (low + high + 1) >> 1;
          if (lineOfBlock(middle) <= line) low = middle;
          else high = middle - 1;
        }
        return way > 0 && low === state.block ? low + 1 : low;
      };
      const choose = (line, way) => (play(false), moveTo(blockAt(line, way)));
      let lines, label = 'NC program';
      if (source.nc_text) {
        lines = await linesOf(source.nc_text);
        const ofBlocks = source.nc_text.of_blocks;
        if (ofBlocks) lineOfBlock = (block) => block;
        ncLine = (block) => lines[lineOfBlock(block)];
        if (ofBlocks) numberOf = (line) => columns.nc_line[line] ?? '';
        beside.append(make('h4', {}, ofBlocks ? 'NC program, the lines of the blocks on this page' : 'NC program'));
      } else {
        lines = Array.from({length: count}, (_, i) => source.axes.map((a, k) => `${a.name}${columns[a.name][i].toFixed(3)}`).join(' '));
        lineOfBlock = (block) => block;
        label = 'Joint positions, block by block';
        beside.append(make('h4', {}, 'Joint positions (the program\'s text is not on this page)'));
      }
      text = program.create(lines, label, choose, numberOf);
      beside.append(text.box);
      text.show(lineOfBlock(state.block));
    }

    stage.hidden = false;
    figure.querySelector('.still').hidden = true;
    figure.querySelector('.why-still').hidden = true;
    await readText();
    tell();
    say();
    if (source.worst.length) moveTo(source.worst[0]);  // the worst place is what is asked for first
    new ResizeObserver(draw).observe(canvas);
    draw();
    // Paper gets the picture as it stands, machine and all, on white.
    const onPaper = make('img', {alt: 'the scene as it was shown'});
    const printed = make('div', {className: 'printed'}, onPaper);
    stage.after(printed);
    function picture() {
      drawNow('#ffffff');
      onPaper.src = canvas.toDataURL('image/png');
      // The arrows stand on it as on the screen, whatever the paper's width.
      const drawn = marks.firstElementChild?.cloneNode(true);
      drawn?.setAttribute('viewBox', `0 0 ${shownSize.join(' ')}`);
      printed.replaceChildren(make('div', {className: 'shown'}, onPaper, ...(drawn ? [drawn] : [])), legend.cloneNode(true));
      figure.classList.add('has-print');
      draw();
    }
    addEventListener('beforeprint', picture);
    matchMedia('print').addEventListener('change', (e) => { if (e.matches) picture(); });
    return {moveTo, redraw: () => (tell(), draw()), state, columns, points, cut, source, tipInPart: (block) => [points[3 * block], points[3 * block + 1], points[3 * block + 2]], drawNow, onScreen: (p) => onScreen(moved(product(world, kinematics.part(source, state.q)), p))};
  }
  return {start};
})();
