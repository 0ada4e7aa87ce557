// What every module of the page uses: its data, its colours, and the texts of numbers.
const core = (() => {
  'use strict';
  const root = document.documentElement;
  const css = (name) => getComputedStyle(root).getPropertyValue(name).trim();

  // Nothing is parsed before it is asked for: a page of a large program answers as soon as its text stands.
  const parsed = new Map();
  function data(name) {
    if (!parsed.has(name)) {
      const element = document.getElementById(`data-${name}`);
      parsed.set(name, element ? JSON.parse(element.textContent) : null);
    }
    return parsed.get(name);
  }

  function bytes(base64) {
    const raw = atob(base64);
    const out = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
    return out;
  }
  const floats = (base64) => new Float32Array(bytes(base64).buffer);

  // The other side of src/report/packed.cpp.
  const canUnpack = typeof DecompressionStream === 'function';
  async function unpacked(base64) {
    const stream = new Blob([bytes(base64)]).stream().pipeThrough(new DecompressionStream('deflate'));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }
  const unpackedText = async (base64) => new TextDecoder().decode(await unpacked(base64));
  async function unpackedColumn({values, count, step}) {
    const planes = await unpacked(values);
    const out = new Float64Array(count);
    let last = 0;
    for (let i = 0; i < count; i++) {
      const change = planes[i] | (planes[count + i] << 8) | (planes[2 * count + i] << 16) | (planes[3 * count + i] << 24);
      last = (last + ((change >>> 1) ^ -(change & 1))) | 0;
      out[i] = last * step;
    }
    return out;
  }

  // The chart library, run when the first chart needs it; nothing where the page has none, or the browser cannot unpack it.
  let library = null;
  function charts() {
    const element = document.getElementById('charts');
    if (!element || !canUnpack) return Promise.resolve(null);
    library ??= unpackedText(element.textContent).then((text) => {
      const run = document.createElement('script');
      run.textContent = text;
      document.head.append(run);
      return globalThis.Plotly;
    });
    return library;
  }

  const hasWebGl = (kind) => {
    try {
      return !!document.createElement('canvas').getContext(kind);
    } catch {
      return false;
    }
  };

  const short = (v, digits = 4) => (Number.isFinite(v) ? String(Number(v.toPrecision(digits))) : '–');
  const isDark = () => (root.dataset.theme ? root.dataset.theme === 'dark' : matchMedia('(prefers-color-scheme: dark)').matches);

  // The same nine places as the still pictures (cividis). On dark paper it begins where it can be seen.
  const cividis = ['#00224e', '#123570', '#3b496c', '#575d6d', '#707173', '#8a8678', '#a59c74', '#c3b369', '#fee838'];
  const places = () => (isDark() ? ['#5b7bb8', '#6480b0', '#7788a5', '#858d9d', '#96979a', '#a8a499', '#bdb48c', '#d6c77c', '#fee838'] : cividis);
  const colourScale = () => places().map((colour, i) => [i / 8, colour]);

  // `make('p', {className: 'x'}, 'text', child)`
  function make(tag, properties = {}, ...children) {
    const element = document.createElement(tag);
    for (const [key, value] of Object.entries(properties)) {
      if (key.includes('-') || key === 'role') element.setAttribute(key, value);
      else element[key] = value;
    }
    element.append(...children);
    return element;
  }
  return {root, css, data, floats, canUnpack, unpackedText, unpackedColumn, charts, hasWebGl, short, isDark, places, colourScale, make};
})();
