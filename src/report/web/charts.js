import Plotly from 'plotly.js/lib/core';
import scatter3d from 'plotly.js/lib/scatter3d';
import mesh3d from 'plotly.js/lib/mesh3d';
import cone from 'plotly.js/lib/cone';
import heatmap from 'plotly.js/lib/heatmap';
import box from 'plotly.js/lib/box';
import bar from 'plotly.js/lib/bar';
// The library's own default offers to send the chart, with the part's data, to its maker's server.
Plotly.setPlotConfig({showSendToCloud: false, plotlyServerURL: '', topojsonURL: ''});
Plotly.register([scatter3d, mesh3d, cone, heatmap, box, bar]);
globalThis.Plotly = Plotly;
