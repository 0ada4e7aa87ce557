// Draws solids, coloured surfaces and lines with WebGL 2: one canvas, one camera, parallel projection.
const gl3 = (() => {
  'use strict';
  const vertexText = `#version 300 es
    in vec3 corner; in float value; uniform mat4 model, camera; out vec3 place; out float shade;
    void main() { vec4 world = model * vec4(corner, 1.0); place = (camera * world).xyz; shade = value; gl_Position = camera * world; }`;
  // Solids and surfaces are lit from the eye, both sides alike; `aspect` undoes the camera's scaling.
  const fragmentText = `#version 300 es
    precision highp float; in vec3 place; in float shade; out vec4 colour;
    uniform vec4 plain; uniform bool byValue, lit; uniform vec3 aspect; uniform sampler2D scale;
    void main() {
      vec3 c = byValue ? texture(scale, vec2(clamp(shade, 0.0, 1.0) * 0.996 + 0.002, 0.5)).rgb : plain.rgb;
      if (lit) {
        vec3 n = normalize(cross(dFdx(place * aspect), dFdy(place * aspect)));
        c *= 0.55 + 0.45 * abs(dot(n, normalize(vec3(0.25, 0.35, 1.0))));
      }
      colour = vec4(c, plain.a);
    }`;

  function create(canvas) {
    const gl = canvas.getContext('webgl2', {antialias: true, preserveDrawingBuffer: true});
    if (!gl) return null;
    const program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, vertexText], [gl.FRAGMENT_SHADER, fragmentText]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.bindAttribLocation(program, 0, 'corner');
    gl.bindAttribLocation(program, 1, 'value');
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return null;
    gl.useProgram(program);
    const at = (name) => gl.getUniformLocation(program, name);
    const uniforms = {model: at('model'), camera: at('camera'), plain: at('plain'), byValue: at('byValue'), lit: at('lit'), aspect: at('aspect'), scale: at('scale')};
    gl.enable(gl.DEPTH_TEST);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);

    const buffer = (kind, numbers) => {
      const out = gl.createBuffer();
      gl.bindBuffer(kind, out);
      gl.bufferData(kind, numbers, gl.STATIC_DRAW);
      return out;
    };
    const rgb = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);
    return {
      corners: (numbers) => buffer(gl.ARRAY_BUFFER, Float32Array.from(numbers)),
      indices: (numbers) => ({buffer: buffer(gl.ELEMENT_ARRAY_BUFFER, Uint32Array.from(numbers)), count: numbers.length}),
      colours(places) {
        const pixels = new Uint8Array(places.length * 4);
        places.forEach((hex, i) => pixels.set([...rgb(hex).map((v) => Math.round(255 * v)), 255], 4 * i));
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, places.length, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      },
      begin(camera, aspect, paper) {
        const ratio = Math.min(devicePixelRatio, 2);
        const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
        // On paper the canvas has no room of its own: it keeps its last size.
        if (width && height && (canvas.width !== width || canvas.height !== height)) [canvas.width, canvas.height] = [width, height];
        gl.disable(gl.SCISSOR_TEST);
        gl.viewport(0, 0, canvas.width, canvas.height);
        gl.clearColor(...rgb(paper), 1);
        gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
        gl.uniformMatrix4fv(uniforms.camera, false, camera);
        gl.uniform3f(uniforms.aspect, ...aspect);
      },
      // Only what is between these shares of the width is drawn from here on.
      between(from, to) {
        gl.enable(gl.SCISSOR_TEST);
        gl.scissor(Math.round(from * canvas.width), 0, Math.round((to - from) * canvas.width), canvas.height);
      },
      // {corners, indices | count, values, colour, lines, lit}
      draw(thing, model) {
        gl.uniformMatrix4fv(uniforms.model, false, model);
        gl.uniform4f(uniforms.plain, ...rgb(thing.colour ?? '#888888'), 1);
        gl.uniform1i(uniforms.byValue, thing.values ? 1 : 0);
        gl.uniform1i(uniforms.lit, thing.lines ? 0 : 1);
        gl.bindBuffer(gl.ARRAY_BUFFER, thing.corners);
        gl.enableVertexAttribArray(0);
        gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
        if (thing.values) {
          gl.bindBuffer(gl.ARRAY_BUFFER, thing.values);
          gl.enableVertexAttribArray(1);
          gl.vertexAttribPointer(1, 1, gl.FLOAT, false, 0, 0);
        } else {
          gl.disableVertexAttribArray(1);
        }
        const kind = thing.lines ? gl.LINES : gl.TRIANGLES;
        if (thing.indices) {
          gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, thing.indices.buffer);
          gl.drawElements(kind, thing.indices.count, gl.UNSIGNED_INT, 0);
        } else {
          gl.drawArrays(kind, 0, thing.count);
        }
      },
    };
  }
  return {create};
})();
