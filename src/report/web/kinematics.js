// Where the bodies of the machine are: the chain of src/report/page.hpp, Scene. Poses are 4 x 4, column by column, as WebGL has them.
const kinematics = (() => {
  'use strict';
  const identity = () => new Float64Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
  const translation = (x, y, z) => new Float64Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1]);
  function product(a, b) {
    const out = new Float64Array(16);
    for (let c = 0; c < 4; c++) {
      for (let r = 0; r < 4; r++) {
        let sum = 0;
        for (let k = 0; k < 4; k++) sum += a[4 * k + r] * b[4 * c + k];
        out[4 * c + r] = sum;
      }
    }
    return out;
  }
  // Of a rotation and a translation.
  function inverse(m) {
    const out = identity();
    for (let r = 0; r < 3; r++) {
      for (let c = 0; c < 3; c++) out[4 * c + r] = m[4 * r + c];
    }
    for (let r = 0; r < 3; r++) out[12 + r] = -(out[r] * m[12] + out[4 + r] * m[13] + out[8 + r] * m[14]);
    return out;
  }
  const moved = (m, [x, y, z]) => [m[0] * x + m[4] * y + m[8] * z + m[12], m[1] * x + m[5] * y + m[9] * z + m[13], m[2] * x + m[6] * y + m[10] * z + m[14]];
  const turned = (m, [x, y, z]) => [m[0] * x + m[4] * y + m[8] * z, m[1] * x + m[5] * y + m[9] * z, m[2] * x + m[6] * y + m[10] * z];

  // Rodrigues, about the line through `point`.
  function rotation([x, y, z], [px, py, pz], degrees) {
    const angle = degrees * Math.PI / 180;
    const [s, c] = [Math.sin(angle), Math.cos(angle)];
    const t = 1 - c;
    const m = identity();
    m[0] = t * x * x + c, m[4] = t * x * y - s * z, m[8] = t * x * z + s * y;
    m[1] = t * x * y + s * z, m[5] = t * y * y + c, m[9] = t * y * z - s * x;
    m[2] = t * x * z - s * y, m[6] = t * y * z + s * x, m[10] = t * z * z + c;
    const [qx, qy, qz] = turned(m, [px, py, pz]);
    m[12] = px - qx, m[13] = py - qy, m[14] = pz - qz;
    return m;
  }
  const motion = (axis, q) => (axis.rotary ? rotation(axis.direction, axis.point, q) : translation(...axis.direction.map((d) => d * q)));

  // The pose of what the first `count` axes of a side's chain carry, at positions `q` (mm, degrees).
  function carried(scene, partSide, count, q) {
    const chain = partSide ? scene.part_chain : scene.tool_chain;
    let out = identity();
    for (let i = 0; i < count; i++) out = product(out, motion(scene.axes[chain[i]], q[chain[i]]));
    return out;
  }
  const part = (scene, q) => product(carried(scene, true, scene.part_chain.length, q), translation(...scene.part));
  // The tip in machine axes.
  function tip(scene, q) {
    const [x, y, z] = scene.spindle;
    return moved(carried(scene, false, scene.tool_chain.length, q), [x, y, z - scene.tool_length]);
  }
  const tipInPart = (scene, q) => moved(inverse(part(scene, q)), tip(scene, q));
  return {identity, product, inverse, moved, turned, carried, part, tip, tipInPart};
})();
