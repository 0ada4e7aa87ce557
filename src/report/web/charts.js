import Plotly from 'plotly.js/lib/core';
import scatter3d from 'plotly.js/lib/scatter3d';
import mesh3d from 'plotly.js/lib/mesh3d';
import cone from 'plotly.js/lib/cone';
import heatmap from 'plotly.js/lib/heatmap';
import box from 'plotly.js/lib/box';
import bar from 'plotly.js/lib/bar';
Plotly.register([scatter3d, mesh3d, cone, heatmap, box, bar]);
globalThis.Plotly = Plotly;
