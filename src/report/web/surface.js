// The surface that a path cuts: its rows, and triangles between neighbouring ones. Indices are those of the blocks.
const surface = (() => {
  'use strict';
  const kCorner = Math.cos(50 * Math.PI / 180);  // a path that turns by more begins a new piece
  const kShortRow = 0.3;                         // of the longest piece of its stretch: what is shorter links rows
  const kFar = 0.3;                              // of a row's length: rows farther from each other are none of one surface

  const distance = (p, a, b) => Math.hypot(p[3 * b] - p[3 * a], p[3 * b + 1] - p[3 * a + 1], p[3 * b + 2] - p[3 * a + 2]);

  // Blocks of one feed move after the other, cut where the path turns; each with its lengths from the start.
  function pieces(points, from, to) {
    const out = [];
    let piece = {blocks: [from], along: [0]};
    let way = null;
    for (let i = from + 1; i <= to; i++) {
      const before = piece.blocks[piece.blocks.length - 1];
      const length = distance(points, before, i);
      if (length < 1e-6) continue;
      const next = [0, 1, 2].map((k) => (points[3 * i + k] - points[3 * before + k]) / length);
      if (way && way[0] * next[0] + way[1] * next[1] + way[2] * next[2] < kCorner) {
        out.push(piece);
        piece = {blocks: [before], along: [0]};
      }
      piece.along.push(piece.along[piece.along.length - 1] + length);
      piece.blocks.push(i);
      way = next;
    }
    out.push(piece);
    return out.filter((p) => p.blocks.length > 1);
  }
  const lengthOf = (row) => row.along[row.along.length - 1];
  function reversed(row) {
    const length = lengthOf(row);
    return {blocks: [...row.blocks].reverse(), along: row.along.map((l) => length - l).reverse()};
  }
  function at(row, share) {
    const length = share * lengthOf(row);
    let i = 0;
    while (i + 1 < row.along.length - 1 && row.along[i + 1] < length) i++;
    return row.blocks[i + (length - row.along[i] > row.along[i + 1] - length ? 1 : 0)];
  }
  function gap(points, a, b) {
    let sum = 0;
    for (const share of [0.1, 0.3, 0.5, 0.7, 0.9]) sum += distance(points, at(a, share), at(b, share)) / 5;
    return sum;
  }
  // Triangles between two rows: whichever is behind goes on.
  function stitch(a, b, triangles) {
    let [i, j] = [0, 0];
    const share = (row, k) => row.along[k] / lengthOf(row);
    while (i + 1 < a.blocks.length || j + 1 < b.blocks.length) {
      const goOn = j + 1 >= b.blocks.length || (i + 1 < a.blocks.length && share(a, i + 1) <= share(b, j + 1));
      if (goOn) triangles.push(a.blocks[i], b.blocks[j], a.blocks[++i]);
      else triangles.push(a.blocks[i], b.blocks[j], b.blocks[++j]);
    }
  }

  // {triangles, rows, links}: three indices a triangle, two a piece of a line.
  function of(points, rapid) {
    const triangles = [], rows = [], links = [];
    const line = (out, blocks) => { for (let i = 1; i < blocks.length; i++) out.push(blocks[i - 1], blocks[i]); };
    const found = [];
    let last = null;
    for (let i = 1; i < rapid.length;) {
      if (rapid[i]) {
        links.push(i - 1, i);
        i++;
        continue;
      }
      let end = i;
      while (end + 1 < rapid.length && !rapid[end + 1]) end++;
      const all = pieces(points, i - 1, end);
      const longest = all.reduce((most, p) => Math.max(most, lengthOf(p)), 0);
      for (const piece of all) {
        if (lengthOf(piece) < kShortRow * longest) {
          line(links, piece.blocks);
          continue;
        }
        let row = piece;
        if (last) {
          const back = reversed(piece);
          if (gap(points, last, back) < gap(points, last, row)) row = back;
          const between = gap(points, last, row);
          if (between > 1e-6 && between < kFar * Math.min(lengthOf(last), lengthOf(row))) {
            stitch(last, row, triangles);
            last.joined = row.joined = true;
          }
        }
        found.push(row);
        last = row;
      }
      i = end + 1;
    }
    // A straight piece without a neighbour goes to the cut or away from it, where other pieces make a surface.
    const isStraight = (row) => lengthOf(row) - distance(points, row.blocks[0], row.blocks[row.blocks.length - 1]) < 1e-3 * lengthOf(row);
    for (const row of found) line(row.joined || !triangles.length || !isStraight(row) ? rows : links, row.blocks);
    return {triangles, rows, links};
  }
  return {of};
})();
