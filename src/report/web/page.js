// Makes the page of src/report interactive. Without the chart library (global Plotly) the drawings stay as they are.
(() => {
  'use strict';
  const root = document.documentElement;
  // Nothing is parsed before it is asked for: a page of a large program answers as soon as its text stands.
  const parsed = new Map();
  function data(name) {
    if (!parsed.has(name)) {
      const element = document.getElementById(`data-${name}`);
      parsed.set(name, element ? JSON.parse(element.textContent) : null);
    }
    return parsed.get(name);
  }
  const library = document.getElementById('charts');
  let charts = null;
  function load() {
    if (charts || !library) return charts;
    const run = document.createElement('script');
    run.textContent = library.textContent;
    document.head.append(run);
    charts = globalThis.Plotly;
    return charts;
  }
  const css = (name) => getComputedStyle(root).getPropertyValue(name).trim();

  const floats = (text) => {
    const raw = atob(text);
    const bytes = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
    return new Float32Array(bytes.buffer);
  };
  const short = (v, digits = 4) => (Number.isFinite(v) ? String(Number(v.toPrecision(digits))) : '–');
  const title = (s) => (s.unit ? `${s.label} / ${s.unit}` : s.label);
  const hasWebGl = (() => {
    try {
      return !!document.createElement('canvas').getContext('webgl');
    } catch {
      return false;
    }
  })();

  // The same nine places as the static drawings (cividis).
  const cividis = ['#00224e', '#123570', '#3b496c', '#575d6d', '#707173', '#8a8678', '#a59c74', '#c3b369', '#fee838']
    .map((colour, i) => [i / 8, colour]);

  const layoutOf = () => ({
    paper_bgcolor: 'rgba(0,0,0,0)',
    plot_bgcolor: 'rgba(0,0,0,0)',
    font: {color: css('--ink'), family: getComputedStyle(document.body).fontFamily, size: 12},
    margin: {l: 66, r: 16, t: 12, b: 48},
    legend: {orientation: 'h', y: 1.02, yanchor: 'bottom', x: 0},
    hoverlabel: {font: {size: 12}},
  });
  const axisOf = (s, more) => ({
    title: {text: title(s)},
    type: s.log ? 'log' : 'linear',
    gridcolor: css('--rule'),
    zerolinecolor: css('--rule'),
    linecolor: css('--soft'),
    exponentformat: 'none',
    automargin: true,
    ...more,
  });
  const spaceAxis = (name, unit) => ({
    title: {text: `${name} / ${unit}`},
    gridcolor: css('--rule'),
    zerolinecolor: css('--rule'),
    color: css('--ink'),
    showbackground: false,
  });
  const colour = (i) => css(`--c${i % 8}`);
  const faint = (hex) => `${hex}38`;

  function flatTraces(f) {
    const traces = [];
    for (const s of f.series) {
      const x = floats(s.x);
      const y = floats(s.y);
      const base = {name: s.name, x, y, showlegend: f.series.length > 1 && s.name !== '', text: s.labels, hoverinfo: 'x+y+name+text'};
      if (s.mark === 'bars') {
        traces.push({...base, type: 'bar', marker: {color: colour(s.colour)}});
      } else if (s.mark === 'band') {
        const line = {width: 0, color: colour(s.colour)};
        traces.push({...base, type: 'scatter', mode: 'lines', line, showlegend: false, hoverinfo: 'skip'});
        traces.push({...base, y: floats(s.y2), type: 'scatter', mode: 'lines', line, fill: 'tonexty', fillcolor: faint(colour(s.colour))});
      } else if (s.mark === 'points') {
        const bars = s.y2 ? {error_y: {array: floats(s.y2), color: colour(s.colour), thickness: 1}} : {};
        traces.push({...base, type: 'scatter', mode: 'markers', marker: {color: colour(s.colour), size: x.length > 400 ? 3 : 6}, ...bars});
      } else {
        traces.push({...base, type: 'scatter', mode: 'lines', line: {color: colour(s.colour), width: 1.5}, connectgaps: false});
      }
    }
    return traces;
  }

  function flatLayout(f) {
    const layout = {...layoutOf(), xaxis: axisOf(f.x), yaxis: axisOf(f.y), barmode: 'group', shapes: [], annotations: []};
    if (f.categories) {
      layout.xaxis.tickvals = f.categories.map((_, i) => i);
      layout.xaxis.ticktext = f.categories;
    }
    if (f.equal) layout.yaxis.scaleanchor = 'x';
    for (const level of f.levels) {
      layout.shapes.push({type: 'line', xref: 'paper', x0: 0, x1: 1, y0: level.value, y1: level.value,
                          line: {color: css('--bad'), width: 1.3, dash: 'dash'}});
      layout.annotations.push({xref: 'paper', x: 1, xanchor: 'right', y: f.y.log ? Math.log10(level.value) : level.value,
                               yanchor: 'bottom', text: level.name, showarrow: false});
    }
    return layout;
  }

  function spaceScene(f) {
    const axis = (name) => spaceAxis(name, f.unit);
    return {xaxis: axis('X'), yaxis: axis('Y'), zaxis: axis('Z'), aspectmode: 'data', camera: {eye: {x: 1.15, y: -1.45, z: 0.85}, center: {x: 0, y: 0, z: -0.1}}};
  }
  const colourBar = (f) => ({title: {text: title(f.colour), side: 'right'}, thickness: 14, len: 0.8});

  function pathTraces(f) {
    // A value that is no number says that the move to its point is not drawn (a rapid): the line breaks before it.
    const [x, y, z, v] = [floats(f.x), floats(f.y), floats(f.z), floats(f.value)];
    const p = {x: [], y: [], z: []};
    const value = [];
    for (let i = 0; i < v.length; i++) {
      if (Number.isNaN(v[i])) {
        p.x.push(null), p.y.push(null), p.z.push(null), value.push(0);
      }
      p.x.push(x[i]), p.y.push(y[i]), p.z.push(z[i]), value.push(Number.isNaN(v[i]) ? v[i + 1] || 0 : v[i]);
    }
    const max = f.max || value.reduce((a, b) => (b > a ? b : a), 0) || 1;
    const line = {color: value, colorscale: cividis, cmin: 0, cmax: max, width: 4, showscale: true, colorbar: colourBar(f)};
    const hovertemplate = `X %{x:.3f} Y %{y:.3f} Z %{z:.3f} ${f.unit}<br>${f.colour.label} %{line.color:.3f} ${f.colour.unit}<extra></extra>`;
    const path = {type: 'scatter3d', mode: 'lines', ...p, line, hovertemplate, showlegend: false};
    const here = {type: 'scatter3d', mode: 'markers', x: [], y: [], z: [], marker: {size: 7, color: css('--bad'), symbol: 'diamond'},
                  hoverinfo: 'skip', showlegend: false};
    return [path, here];
  }

  function vectorTraces(f) {
    const x = floats(f.x), y = floats(f.y), z = floats(f.z), u = floats(f.u), v = floats(f.v), w = floats(f.w);
    const value = floats(f.value);
    const max = f.max || value.reduce((a, b) => (b > a ? b : a), 0) || 1;
    const line = {x: [], y: [], z: [], c: []};
    for (let i = 0; i < x.length; i++) {
      line.x.push(x[i], x[i] + f.magnification * u[i], null);
      line.y.push(y[i], y[i] + f.magnification * v[i], null);
      line.z.push(z[i], z[i] + f.magnification * w[i], null);
      line.c.push(value[i], value[i], value[i]);
    }
    return [
      {type: 'scatter3d', mode: 'lines', x: line.x, y: line.y, z: line.z, hoverinfo: 'skip', showlegend: false,
       line: {color: line.c, colorscale: cividis, cmin: 0, cmax: max, width: 4}},
      {type: 'scatter3d', mode: 'markers', x, y, z, text: f.labels, hoverinfo: 'x+y+z+text', showlegend: false,
       marker: {size: 3, color: value, colorscale: cividis, cmin: 0, cmax: max, showscale: true, colorbar: colourBar(f)}},
    ];
  }

  function traces(f) {
    if (f.kind === 'xy') return flatTraces(f);
    if (f.kind === 'path') return pathTraces(f);
    if (f.kind === 'vectors') return vectorTraces(f);
    if (f.kind === 'box') {
      return f.samples.map((s) => ({type: 'box', name: s.name, y: floats(s.y), marker: {color: colour(0)}, boxpoints: 'outliers', showlegend: false}));
    }
    return [{type: 'heatmap', x: f.columns, y: f.rows, z: f.z, zmin: 0, zmax: f.max, colorscale: cividis, colorbar: colourBar(f)}];
  }
  function layout(f) {
    if (f.kind === 'xy') return flatLayout(f);
    if (f.kind === 'box') return {...layoutOf(), xaxis: {gridcolor: css('--rule')}, yaxis: axisOf(f.y)};
    if (f.kind === 'matrix') return {...layoutOf(), margin: {l: 150, r: 16, t: 12, b: 120}, yaxis: {autorange: 'reversed'}};
    return {...layoutOf(), margin: {l: 0, r: 0, t: 0, b: 0}, scene: spaceScene(f)};
  }
  // One drawn point per screen pixel: the library's own 2 costs four times as much where there is no graphics card.
  // The toolbar has the buttons of these lists and no others: none of them sends, saves or opens anything.
  const flatButtons = [['zoom2d', 'pan2d'], ['zoomIn2d', 'zoomOut2d', 'autoScale2d', 'resetScale2d']];
  const spaceButtons = [['zoom3d', 'pan3d', 'orbitRotation', 'tableRotation'], ['resetCameraDefault3d']];
  const configOf = (space) => ({
    responsive: true, displaylogo: false, modeBarButtons: space ? spaceButtons : flatButtons, showSendToCloud: false, plotlyServerURL: '',
    plotGlPixelRatio: Math.max(1, devicePixelRatio),
  });
  // No code of the page, the chart library's included, can open another one.
  globalThis.open = () => null;
  const kMostSpaces = 6;  // browsers take the drawing context from the oldest beyond 8 to 16

  const isSpace = (f) => f.kind === 'path' || f.kind === 'vectors';
  const live = new Map();  // figure id -> element that holds the chart
  function activate(element) {
    const f = data(element.dataset.figure);
    const space = f && isSpace(f);
    if (!f || !load() || live.has(element.dataset.figure) || (space && !hasWebGl)) return;
    const holder = element.querySelector('.live');
    holder.hidden = false;
    holder.classList.toggle('space', space);
    element.querySelector('.still').hidden = true;
    if (space) giveUpFarthest(element);
    live.set(element.dataset.figure, holder);
    return charts.newPlot(holder, traces(f), layout(f), configOf(space));
  }
  // Where too many charts in space are alive the one farthest from `element` becomes its drawing again.
  function giveUpFarthest(element) {
    const spaces = [...live.keys()].map((id) => document.getElementById(id)).filter((e) => e.querySelector('.live.space'));
    if (spaces.length < kMostSpaces) return;
    const from = element.getBoundingClientRect().top;
    const distance = (e) => Math.abs(e.getBoundingClientRect().top - from);
    const farthest = spaces.reduce((a, b) => (distance(b) > distance(a) ? b : a));
    const holder = farthest.querySelector('.live');
    charts.purge(holder);
    holder.hidden = true;
    farthest.querySelector('.still').hidden = false;
    live.delete(farthest.dataset.figure);
    near.observe(farthest);
  }

  // ---- the machine
  const slider = document.getElementById('stop');
  const decoded = {};
  let machine = null;
  let stops = 0;
  let carried = [];
  function prepareMachine() {
    if (machine) return;
    machine = data('machine');
    stops = machine.nc_line.length;
    for (const key of ['pose', 'tip', 'axes', 'path', 'deviation']) decoded[key] = floats(machine[key]);
    const part = data(machine.space_figure);
    // The path goes with the table; some hundred points show where it is.
    const x = floats(part.x), y = floats(part.y), z = floats(part.z);
    const step = Math.max(1, Math.floor(x.length / 1500));
    const path = [];
    for (let i = 0; i < x.length; i += step) path.push(x[i], y[i], z[i]);
    carried = machine.outlines.map((o) => ({...o, points: floats(o.points)}));
    carried.push({name: 'tool path', moves: true, points: path});
  }
  function placed(points, stop) {
    const m = decoded.pose.subarray(12 * stop, 12 * stop + 12);
    const out = {x: [], y: [], z: []};
    for (let i = 0; i < points.length; i += 3) {
      const [a, b, c] = [points[i], points[i + 1], points[i + 2]];
      if (Number.isNaN(a)) {
        out.x.push(null), out.y.push(null), out.z.push(null);
        continue;
      }
      out.x.push(m[0] * a + m[1] * b + m[2] * c + m[3]);
      out.y.push(m[4] * a + m[5] * b + m[6] * c + m[7]);
      out.z.push(m[8] * a + m[9] * b + m[10] * c + m[11]);
    }
    return out;
  }
  const still = (points) => ({x: [...points].filter((_, i) => i % 3 === 0), y: [...points].filter((_, i) => i % 3 === 1),
                              z: [...points].filter((_, i) => i % 3 === 2)});
  function machineLines(stop) {
    const lines = carried.map((o) => (o.moves ? placed(o.points, stop) : still(o.points)));
    const tip = placed(decoded.tip.subarray(3 * stop, 3 * stop + 3), stop);
    lines.push({x: [tip.x[0], tip.x[0]], y: [tip.y[0], tip.y[0]], z: [tip.z[0], tip.z[0] + machine.tool_length]});
    return lines;
  }
  // A cube that holds every position, so that the view stands still while the machine moves.
  function machineRange() {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let s = 0; s < stops; s += Math.max(1, Math.floor(stops / 60))) {
      for (const l of machineLines(s)) {
        [l.x, l.y, l.z].forEach((v, k) => v.forEach((p) => {
          if (p === null) return;
          low[k] = Math.min(low[k], p);
          high[k] = Math.max(high[k], p);
        }));
      }
    }
    return [0, 1, 2].map((k) => [low[k], high[k]]);
  }
  const machineHolder = document.querySelector('#machine .live');
  function drawMachine() {
    prepareMachine();
    load();
    const lines = machineLines(Number(slider.value));
    const names = [...carried.map((o) => o.name), 'tool'];
    const colours = [...carried.map((o, i) => (o.name === 'tool path' ? css('--c0') : css(`--c${7 - (i % 3) * 2}`))), css('--bad')];
    const data = lines.map((l, i) => ({type: 'scatter3d', mode: 'lines', ...l, name: names[i], hoverinfo: 'name',
                                       line: {color: colours[i], width: names[i] === 'tool' ? 12 : names[i] === 'tool path' ? 2 : 5}}));
    const range = machineRange();
    const scene = spaceScene({unit: 'mm'});
    [scene.xaxis.range, scene.yaxis.range, scene.zaxis.range] = range;
    machineHolder.classList.add('space');
    return charts.newPlot(machineHolder, data, {...layoutOf(), margin: {l: 0, r: 0, t: 0, b: 0}, scene}, configOf(true));
  }
  function stopText(s) {
    const names = machine.axis_names.map((name, i) => `${name} ${short(decoded.axes[s * machine.axis_names.length + i], 7)} ${machine.axis_units[i]}`);
    return `NC line ${machine.nc_line[s]}, CL line ${machine.cl_line[s]}, ${short(decoded.path[s], 6)} mm along the path: ` +
      `deviation ${short(decoded.deviation[s])} µm. ${names.join('  ')}`;
  }
  function moveTo(stop, look) {
    prepareMachine();
    slider.value = stop;
    document.getElementById('stop-text').textContent = stopText(stop);
    const lines = machineLines(stop);
    if (machineHolder.data) charts.restyle(machineHolder, {x: lines.map((l) => l.x), y: lines.map((l) => l.y), z: lines.map((l) => l.z)});
    const tip = decoded.tip.subarray(3 * stop, 3 * stop + 3);
    const space = live.get(machine.space_figure);
    if (space && space.data) {
      charts.restyle(space, {x: [[tip[0]]], y: [[tip[1]]], z: [[tip[2]]]}, [1]);
      if (look) lookAt(space, tip);
    }
    const flat = live.get(machine.path_figure);
    if (flat && flat.data) {
      const at = decoded.path[stop];
      const whole = decoded.path[stops - 1] - decoded.path[0];
      const cursor = {type: 'line', yref: 'paper', y0: 0, y1: 1, x0: at, x1: at, line: {color: css('--bad'), width: 1}};
      const shapes = flatLayout(data(machine.path_figure)).shapes.concat([cursor]);
      charts.relayout(flat, look ? {shapes, 'xaxis.range': [at - whole / 100, at + whole / 100]} : {shapes});
    }
  }
  // The camera turns about the place and comes nearer. Plotly counts from the middle of the data, longest side about 1 to each side.
  function lookAt(holder, p) {
    const scene = holder._fullLayout.scene;
    const axes = [scene.xaxis, scene.yaxis, scene.zaxis];
    const ratio = [scene.aspectratio.x, scene.aspectratio.y, scene.aspectratio.z];
    const c = axes.map((a, k) => ((p[k] - a.range[0]) / (a.range[1] - a.range[0]) - 0.5) * ratio[k]);
    charts.relayout(holder, {'scene.camera.center': {x: c[0], y: c[1], z: c[2]},
                             'scene.camera.eye': {x: c[0] + 0.35, y: c[1] - 0.45, z: c[2] + 0.3}});
  }
  function startMachine() {
    if (!library || !slider || !hasWebGl) return;
    const figure = document.getElementById('machine');
    figure.hidden = false;
    // The words follow the slider at once; the first drawing takes longer.
    slider.addEventListener('input', () => {
      moveTo(Number(slider.value), false);
      if (!machineHolder.data && !waiting.includes(figure)) start(figure);
    });
    document.querySelectorAll('button[data-stop]').forEach((button) => button.addEventListener('click', () => {
      document.querySelectorAll('tr.chosen').forEach((row) => row.classList.remove('chosen'));
      button.closest('tr').classList.add('chosen');
      prepareMachine();
      const space = document.getElementById(machine.space_figure);
      activate(space);
      moveTo(Number(button.dataset.stop), true);
      space.scrollIntoView({block: 'nearest'});
    }));
    near.observe(figure);
    soon(() => moveTo(Number(slider.value), false));
  }

  // ---- light and dark
  function redraw() {
    for (const [id, holder] of live) {
      const f = data(id);
      charts.react(holder, traces(f), layout(f), configOf(isSpace(f)));
    }
    if (machineHolder && machineHolder.data) {
      drawMachine();
      moveTo(Number(slider.value), false);
    }
  }
  document.getElementById('theme').addEventListener('click', () => {
    const dark = root.dataset.theme ? root.dataset.theme === 'dark' : matchMedia('(prefers-color-scheme: dark)').matches;
    root.dataset.theme = dark ? 'light' : 'dark';
    redraw();
  });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redraw);

  // Charts start one by one when they come near the window: the page is there, and answers, at once.
  const soon = (work) => (globalThis.requestIdleCallback ? requestIdleCallback(work, {timeout: 1000}) : setTimeout(work, 20));
  const waiting = [];
  function startNext() {
    const element = waiting.shift();
    if (!element) return;
    if (element.id === 'machine') {
      if (!machineHolder.data) drawMachine();
    } else {
      activate(element);
    }
    if (waiting.length) soon(startNext);
  }
  const near = new IntersectionObserver((entries) => entries.forEach((entry) => {
    if (!entry.isIntersecting) return;
    near.unobserve(entry.target);
    start(entry.target);
  }), {rootMargin: '200px'});
  function start(element) {
    waiting.push(element);
    if (waiting.length === 1) soon(startNext);
  }
  document.querySelectorAll('figure[data-figure]').forEach((figure) => near.observe(figure));
  startMachine();
  root.dataset.ready = 'true';
})();
