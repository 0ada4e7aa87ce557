// The text of a program beside its scene: only the lines in sight stand in the page, so that a hundred thousand cost nothing.
const program = (() => {
  'use strict';
  const {make} = core;
  const kLine_px = 20;

  // `lines` of text; `choose(line)` is called with a line's index when the reader goes there; `numberOf(line)` stands before it.
  function create(lines, label, choose, numberOf) {
    const spacer = make('div', {className: 'lines'});
    const box = make('div', {className: 'program', tabIndex: 0, role: 'listbox', 'aria-label': label}, spacer);
    spacer.style.height = `${kLine_px * lines.length}px`;
    const digits = String(numberOf(lines.length - 1)).length;
    let chosen = -1;
    function draw() {
      const first = Math.max(0, Math.floor(box.scrollTop / kLine_px) - 4);
      const last = Math.min(lines.length, Math.ceil((box.scrollTop + box.clientHeight) / kLine_px) + 4);
      const shown = [];
      for (let i = first; i < last; i++) {
        const line = make('div', {className: i === chosen ? 'line chosen' : 'line', id: `nc-${i + 1}`, role: 'option', 'aria-selected': String(i === chosen)},
                          make('span', {className: 'line-number'}, String(numberOf(i)).padStart(digits)), lines[i] || ' ');
        line.style.top = `${kLine_px * i}px`;
        line.dataset.line = i;
        shown.push(line);
      }
      spacer.replaceChildren(...shown);
      if (chosen >= first && chosen < last) box.setAttribute('aria-activedescendant', `nc-${chosen + 1}`);
      else box.removeAttribute('aria-activedescendant');
    }
    function show(i) {
      chosen = i;
      const y = kLine_px * i;
      if (y < box.scrollTop + kLine_px || y > box.scrollTop + box.clientHeight - 2 * kLine_px) box.scrollTop = y - box.clientHeight / 2;
      draw();
    }
    box.addEventListener('scroll', draw);
    box.addEventListener('click', (event) => {
      const line = event.target.closest('.line');
      if (line) choose(Number(line.dataset.line));
    });
    const page = () => Math.max(1, Math.floor(box.clientHeight / kLine_px) - 1);
    const keys = {ArrowDown: () => chosen + 1, ArrowUp: () => chosen - 1, PageDown: () => chosen + page(), PageUp: () => chosen - page(), Home: () => 0, End: () => lines.length - 1};
    box.addEventListener('keydown', (event) => {
      if (!keys[event.key]) return;
      event.preventDefault();
      choose(Math.min(Math.max(keys[event.key](), 0), lines.length - 1), Math.sign(keys[event.key]() - chosen));
    });
    new ResizeObserver(draw).observe(box);
    return {box, show};
  }
  return {create};
})();
