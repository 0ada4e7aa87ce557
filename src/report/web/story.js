// A story is a row of sections of which one is shown at a time; paper, and a browser without scripts, show all.
(() => {
  'use strict';
  document.querySelectorAll('.story').forEach((story) => {
    const steps = [...story.children];
    if (steps.length < 2) return;
    const bar = document.createElement('div');
    bar.className = 'story-bar';
    bar.setAttribute('role', 'group');
    bar.setAttribute('aria-label', 'Steps of the story');
    const place = document.createElement('span');
    place.setAttribute('aria-live', 'polite');
    let shown = 0;
    const show = (k) => {
      shown = Math.min(Math.max(k, 0), steps.length - 1);
      steps.forEach((step, i) => { step.hidden = i !== shown; });
      place.textContent = `${steps[shown].querySelector('h2').textContent} (${shown + 1} of ${steps.length})`;
      back.disabled = shown === 0;
      on.disabled = shown === steps.length - 1;
    };
    const button = (text, by) => {
      const b = document.createElement('button');
      b.type = 'button';
      b.textContent = text;
      b.addEventListener('click', () => show(shown + by));
      return b;
    };
    const back = button('◀ step back', -1);
    const on = button('next step ▶', 1);
    bar.append(back, place, on);
    story.prepend(bar);
    // The links to a section open it.
    document.querySelectorAll('nav a[href^="#section-"]').forEach((link) => link.addEventListener('click', () => {
      const k = steps.findIndex((step) => `#${step.id}` === link.getAttribute('href'));
      if (k >= 0) show(k);
    }));
    show(0);
  });
})();
