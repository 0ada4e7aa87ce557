// Figures of the page's data as traces and layouts of the chart library.
const figures = (() => {
  'use strict';
  const {css, floats, short, colourScale} = core;
  const title = (s) => (s.unit ? `${s.label} / ${s.unit}` : s.label);

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
  const colour = (i) => (i < 0 ? css('--rule') : css(`--c${i % 8}`));
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
      // Every name stands: turned where there is no room, and never left out.
      Object.assign(layout.xaxis, {autotickangles: [0, -35, -60, -90], ticklabeloverflow: 'allow'});
      // One bar or two are no wider than they would be among three.
      const room = Math.max(0, 3 - f.categories.length) / 2;
      if (room) layout.xaxis.range = [-0.5 - room, f.categories.length - 0.5 + room];
    }
    if (f.equal) layout.yaxis.scaleanchor = 'x';
    if (!f.numbered) [layout.xaxis, layout.yaxis].forEach((axis) => Object.assign(axis, {showticklabels: false, showgrid: false, zeroline: true}));
    for (const level of f.levels) {
      layout.shapes.push({type: 'line', xref: 'paper', x0: 0, x1: 1, y0: level.value, y1: level.value,
                          line: {color: css('--bad'), width: 1.3, dash: 'dash'}});
      layout.annotations.push({xref: 'paper', x: 1, xanchor: 'right', y: f.y.log ? Math.log10(level.value) : level.value,
                               yanchor: 'bottom', text: level.name, showarrow: false});
    }
    return layout;
  }

  // The whole box with the names of its axes is in the picture; a narrow one is looked at from farther away.
  const eye = () => {
    const far = innerWidth < 600 ? 1.9 : 1.25;
    return {x: 1.15 * far, y: -1.45 * far, z: 0.85 * far};
  };
  function spaceScene(f) {
    const axis = (name) => spaceAxis(name, f.unit);
    return {xaxis: axis('X'), yaxis: axis('Y'), zaxis: axis('Z'), aspectmode: 'data', camera: {eye: eye(), center: {x: 0, y: 0, z: -0.12}}};
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
    const line = {color: value, colorscale: colourScale(), cmin: 0, cmax: max, width: 4, showscale: true, colorbar: colourBar(f)};
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
       line: {color: line.c, colorscale: colourScale(), cmin: 0, cmax: max, width: 4}},
      {type: 'scatter3d', mode: 'markers', x, y, z, text: f.labels, hoverinfo: 'x+y+z+text', showlegend: false,
       marker: {size: 3, color: value, colorscale: colourScale(), cmin: 0, cmax: max, showscale: true, colorbar: colourBar(f)}},
    ];
  }

  function traces(f) {
    if (f.kind === 'xy') return flatTraces(f);
    if (f.kind === 'path') return pathTraces(f);
    if (f.kind === 'vectors') return vectorTraces(f);
    if (f.kind === 'box') {
      return f.samples.map((s) => ({type: 'box', name: s.name, y: floats(s.y), marker: {color: colour(0)}, boxpoints: 'outliers', showlegend: false}));
    }
    return [{type: 'heatmap', x: f.columns, y: f.rows, z: f.z, zmin: 0, zmax: f.max, colorscale: colourScale(), colorbar: colourBar(f)}];
  }
  function layout(f) {
    if (f.kind === 'xy') return flatLayout(f);
    if (f.kind === 'box') return {...layoutOf(), xaxis: {gridcolor: css('--rule')}, yaxis: axisOf(f.y)};
    if (f.kind === 'matrix') return {...layoutOf(), margin: {l: 150, r: 16, t: 12, b: 120}, yaxis: {autorange: 'reversed'}};
    return {...layoutOf(), margin: {l: 0, r: 0, t: 0, b: 0}, scene: spaceScene(f)};
  }

  // Room that a long list of names takes from a chart of `width` pixels, beyond what two rows of it take.
  function nameRows_px(f, width) {
    const named = f.kind === 'xy' ? f.series.filter((s) => s.name !== '').length : 0;
    const perRow = Math.max(1, Math.floor((width - 80) / 190));
    return 19 * Math.max(0, Math.ceil(named / perRow) - 2);
  }

  const isSpace = (f) => f.kind === 'path' || f.kind === 'vectors';
  return {traces, layout, flatLayout, isSpace, nameRows_px};
})();
