// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The page: passes the viewer's messages to picture and panel, and requests to the viewer.

import { Connection } from './connection.js';
import { arithmetic, button, put } from './control.js';
import { Hand } from './hand.js';
import { Mechanism } from './mechanism.js';
import { Panel } from './panel.js';
import { Picture } from './picture.js';
import { units } from './units.js';
import { View } from './view.js';

const REFUSED = 4000;
const LOCUS = ['locus', 'loci'];
const mechanisms = new Map();
const at = id => document.getElementById(id);
const [views, status, names, workshop, arrows, whole, notice] = [
  'views', 'status', 'names', 'workshop', 'arrows', 'whole', 'notice'].map(at);
const naming = names.closest('label');
/** What a reload keeps. */
const stored = { shown: '', from: {}, names: true, workshop: false, arrows: '', ...JSON.parse(sessionStorage.getItem('kept') ?? '{}') };
let { shown } = stored;
let fading = 0;
let scheduled = false;
let frames = 0;

const store = values => sessionStorage.setItem('kept', JSON.stringify(Object.assign(stored, values)));

const picture = new Picture(at('picture'));
const hand = new Hand(picture, {
  drag(mechanism, want) {
    panel.drag(mechanism.key, want);
    draw();
  },
  light,
  choose: (mechanism, dimension) => panel.goTo(mechanism.key, dimension),
});
picture.pull = () => hand.pull;
picture.view = new View(picture.canvas, () => hand.grabbed !== null, stored.from, () => {
  whole.hidden = picture.view.whole;
  store({ from: picture.view.from });
  draw();
});
whole.hidden = picture.view.whole;
whole.onclick = () => picture.view.reset();

/** Light up the bars of a dimension, and its slider. */
function light(mechanism, dimension) {
  if (picture.lit.mechanism === mechanism && picture.lit.dimension === dimension) return;
  picture.lit = { mechanism, dimension };
  panel.lit(mechanism?.key, dimension);
  draw();
}

/** Show over the picture why it is not available or cannot be moved; an empty text hides it. */
function say(words) {
  clearTimeout(fading);
  put(notice, { textContent: words, hidden: !words });
}

/** Say for a while why a joint is not dragged; its part of the panel says so till it is. */
function refuse(words) {
  say(words);
  fading = setTimeout(say, REFUSED, '');
}

const connection = new Connection({
  opened() {
    for (const mechanism of mechanisms.values()) mechanism.markers.clear();
    say(mechanisms.size ? '' : 'Loading …');
    status.textContent = 'connected';
  },

  closed() {
    say('Connection lost: the viewer is gone. Trying again …');
    status.textContent = 'not connected';
  },

  scene({ mechanisms: described }) {
    const known = new Map(mechanisms);
    mechanisms.clear();
    for (const one of described) {
      const mechanism = known.get(one.key) ?? new Mechanism(one, connection);
      mechanism.describe(one);
      // Mechanisms of one name in two namespaces have distinct titles.
      mechanism.title = described.some(({ key, name }) => name === one.name && key !== one.key) ? one.key.slice(1) : one.name;
      mechanisms.set(one.key, mechanism);
    }
    at('empty').hidden = mechanisms.size > 0;
    say('');
    // What was shown before a reload, or before the viewer ended, may be found later.
    show(mechanisms.has(stored.shown) || !mechanisms.size ? stored.shown : '');
  },

  look({ number, mechanism, ...look }) {
    const drawn = mechanisms.get(mechanism) ?? new Mechanism({ key: mechanism }, connection);
    mechanisms.set(mechanism, drawn);
    drawn.markers.set(number, { points: new Float32Array(), ...drawn.markers.get(number), look });
    picture.refit(mechanism);
  },

  value({ mechanism: key, name, value, drawn }) {
    const mechanism = mechanisms.get(key);
    const setting = mechanism?.settings.get(name);
    if (!setting) return;
    setting.value = value;
    Object.assign(mechanism, drawn);
    panel.update(key, name, value);
    if (typeof value !== 'number') show(shown);
    if (setting.group !== 'speeds' && setting.group !== 'starts') picture.refit(key);
  },

  frame(buffer) {
    const numbers = new DataView(buffer);
    const now = performance.now();
    for (let from = 0; from < buffer.byteLength;) {
      const number = numbers.getUint32(from, true);
      const count = numbers.getUint32(from + 4, true);
      for (const mechanism of mechanisms.values()) {
        const marker = mechanism.markers.get(number);
        if (!marker) continue;
        marker.points = new Float32Array(buffer, from + 8, 3 * count);
        if (!LOCUS.includes(marker.look.kind)) mechanism.lastMarkers = now;
      }
      from += 8 + 12 * count;
    }
    panel.follow();
    draw(() => connection.tell({ op: 'drawn' }));
    frames += 1;
  },
});
arithmetic.ask = text => connection.ask({ op: 'read', text });

const panel = new Panel(at('panel'), light, refuse);

/** Draw once before the next refresh of the screen, then call `after`. */
function draw(after) {
  if (scheduled && !after) return;
  scheduled = true;
  requestAnimationFrame(() => {
    scheduled = false;
    try {
      picture.draw();
    } finally {
      after?.();
    }
  });
}

function show(key) {
  if (key !== shown) picture.view.reset();
  shown = key;
  const several = mechanisms.size > 1;
  const labels = several ? [['', 'all'], ...[...mechanisms.values()].map(one => [one.key, one.title])] : [];
  views.replaceChildren(...labels.map(([value, title]) => button(title, () => {
    store({ shown: value });
    show(value);
  }, { ariaPressed: value === key })));
  const selected = [...mechanisms.values()].filter(mechanism => !key || mechanism.key === key);
  for (const mechanism of selected) mechanism.arrows.kind = stored.arrows;
  picture.show(selected);
  panel.show(selected, several && !key);
  naming.hidden = selected.length !== 1 || selected[0].legs > 1;
  draw();
}

/** Apply the options above the picture, and save them for a reload. */
function choose() {
  store({ names: names.checked, workshop: workshop.checked, arrows: arrows.value });
  picture.named = stored.names;
  if (units.workshop !== stored.workshop) units.choose(stored.workshop);
  for (const mechanism of mechanisms.values()) mechanism.arrows = { kind: stored.arrows, at: {} };
  draw();
}

[names.checked, workshop.checked, arrows.value] = [stored.names, stored.workshop, stored.arrows];
names.onchange = workshop.onchange = arrows.onchange = choose;
choose();

new ResizeObserver(() => draw()).observe(picture.canvas);

setInterval(() => {
  if (connection.opened) status.textContent = `${frames} pictures/s`;
  frames = 0;
  panel.check(performance.now());
}, 1000);
