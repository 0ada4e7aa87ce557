// Brings the page to life: charts and the scene start when they come near the window. Without the chart library the still pictures stay.
(() => {
  'use strict';
  const {root, css, data, charts, make} = core;
  // No code of the page, the chart library's included, can open another one.
  globalThis.open = () => null;
  // One drawn point per screen pixel: the library's own 2 costs four times as much where there is no graphics card.
  // The toolbar has the buttons of these lists and no others: none of them sends, saves or opens anything.
  const flatButtons = [['zoom2d', 'pan2d'], ['zoomIn2d', 'zoomOut2d', 'autoScale2d', 'resetScale2d']];
  const spaceButtons = [['zoom3d', 'pan3d', 'orbitRotation', 'tableRotation'], ['resetCameraDefault3d']];
  const configOf = (space) => ({
    responsive: true, displaylogo: false, modeBarButtons: space ? spaceButtons : flatButtons, showSendToCloud: false, plotlyServerURL: '',
    plotGlPixelRatio: Math.max(1, devicePixelRatio),
  });
  const kMostSpaces = 5;  // with the scene: browsers take the drawing context from the oldest beyond 8 to 16
  const hasWebGl = core.hasWebGl('webgl');

  const live = new Map();  // figure id -> element that holds the chart
  let library = null;
  async function activate(element) {
    const id = element.dataset.figure;
    const f = data(id);
    const space = f && figures.isSpace(f);
    if (space && !hasWebGl) return void sayWhyStill(element);
    library ??= await charts();
    if (!f || !library || live.has(id)) return;
    const holder = element.querySelector('.live');
    holder.hidden = false;
    holder.classList.toggle('space', space);
    const rows_px = figures.nameRows_px(f, holder.clientWidth);
    if (rows_px > 0) holder.style.height = `${holder.clientHeight + rows_px}px`;
    holder.setAttribute('role', 'group');
    holder.setAttribute('aria-label', `${element.querySelector('h3').textContent}. ${element.querySelector('figcaption').textContent}`);
    element.querySelector('.still').hidden = true;
    if (space) giveUpFarthest(element);
    live.set(id, holder);
    const layout = figures.layout(f);
    if (space && camera) layout.scene.camera = camera;
    await library.newPlot(holder, figures.traces(f), layout, configOf(space));
    if (space) holder.on('plotly_relayout', (change) => lookAlike(holder, change['scene.camera']));
  }
  // One camera for all charts in space: what is compared is seen from the same side.
  let camera = null;
  function lookAlike(from, seen) {
    if (!seen || seen === camera) return;
    camera = seen;
    for (const holder of live.values()) {
      if (holder !== from && holder.classList.contains('space')) library.relayout(holder, {'scene.camera': seen});
    }
  }
  function sayWhyStill(element) {
    if (element.querySelector('.why-still')) return;
    element.querySelector('.plot').after(make('p', {className: 'why-still'}, 'This is a still picture: this browser has no WebGL.'));
  }
  // Where too many charts in space are alive the one farthest from `element` becomes its drawing again.
  function giveUpFarthest(element) {
    const spaces = [...live.keys()].map((id) => document.getElementById(id)).filter((e) => e.querySelector('.live.space'));
    if (spaces.length < kMostSpaces) return;
    const from = element.getBoundingClientRect().top;
    const far = (e) => Math.abs(e.getBoundingClientRect().top - from);
    const farthest = spaces.reduce((a, b) => (far(b) > far(a) ? b : a));
    const holder = farthest.querySelector('.live');
    library.purge(holder);
    holder.hidden = true;
    farthest.querySelector('.still').hidden = false;
    live.delete(farthest.dataset.figure);
    near.observe(farthest);
  }

  // ---- the scene, and the plot over path length that follows it
  const sceneFigure = document.getElementById('scene');
  let started = null;
  function followed(source, columns, block, near_) {
    const flat = live.get(source.path_figure);
    if (!flat?.data) return;
    const at = columns.path_mm[block];
    const whole = columns.path_mm[columns.path_mm.length - 1] - columns.path_mm[0];
    const cursor = {type: 'line', yref: 'paper', y0: 0, y1: 1, x0: at, x1: at, line: {color: css('--bad'), width: 1}};
    const shapes = figures.flatLayout(data(source.path_figure)).shapes.concat([cursor]);
    library.relayout(flat, near_ ? {shapes, 'xaxis.range': [at - whole / 100, at + whole / 100]} : {shapes});
  }
  function startScene() {
    started ??= scene.start(sceneFigure, {moved: followed});
    return started;
  }
  document.querySelectorAll('button[data-stop]').forEach((button) => button.addEventListener('click', async () => {
    document.querySelectorAll('tr.chosen').forEach((row) => row.classList.remove('chosen'));
    button.closest('tr').classList.add('chosen');
    (await startScene())?.moveTo(Number(button.dataset.stop), {near: true});
    sceneFigure.scrollIntoView({block: 'nearest'});
  }));
  // For tests, and for whoever wants to know.
  globalThis.trunnionScene = () => (sceneFigure ? startScene() : null);

  // ---- light and dark
  async function redraw() {
    for (const [id, holder] of live) {
      const f = data(id);
      library.react(holder, figures.traces(f), figures.layout(f), configOf(figures.isSpace(f)));
    }
    (await started)?.redraw();
  }
  document.getElementById('theme').addEventListener('click', () => {
    root.dataset.theme = core.isDark() ? 'light' : 'dark';
    redraw();
  });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redraw);

  // Charts start one by one when they come near the window: the page is there, and answers, at once.
  const soon = (work) => (globalThis.requestIdleCallback ? requestIdleCallback(work, {timeout: 1000}) : setTimeout(work, 20));
  const waiting = [];
  let busy = false;
  async function startNext() {
    const element = waiting.shift();
    if (!element) return void (busy = false);
    await (element === sceneFigure ? startScene() : activate(element));
    soon(startNext);
  }
  const near = new IntersectionObserver((entries) => entries.forEach((entry) => {
    if (!entry.isIntersecting) return;
    near.unobserve(entry.target);
    waiting.push(entry.target);
    if (!busy) soon(startNext);
    busy = true;
  }), {rootMargin: '200px'});
  document.querySelectorAll('figure[data-figure]').forEach((figure) => near.observe(figure));
  if (sceneFigure) near.observe(sceneFigure);
  root.dataset.ready = 'true';
})();
