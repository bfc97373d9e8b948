// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The page: what the viewer sends goes into the picture and the panel, what is dragged goes back.

import { Connection } from './connection.js';
import { Hand } from './hand.js';
import { Mechanism } from './mechanism.js';
import { Panel } from './panel.js';
import { Picture } from './picture.js';
import { units } from './units.js';
import { View } from './view.js';

const mechanisms = new Map();
const views = document.getElementById('views');
const status = document.getElementById('status');
const names = document.getElementById('names');
const naming = names.closest('label');
let shown = '';
let scheduled = false;
let frames = 0;

const picture = new Picture(document.getElementById('picture'));
const hand = new Hand(picture, {
  drag(mechanism, want) {
    panel.drag(mechanism.key, want);
    draw();
  },
  light,
  choose: (mechanism, dimension) => panel.goTo(mechanism.key, dimension),
});
picture.pull = () => hand.pull;
const whole = document.getElementById('whole');
picture.view = new View(picture.canvas, () => hand.grabbed !== null, () => {
  whole.hidden = picture.view.whole;
  draw();
});
whole.onclick = () => picture.view.reset();

/** Light up the bars of a dimension, and its slider. */
function light(mechanism, dimension) {
  if (picture.lit.mechanism === mechanism && picture.lit.dimension === dimension) return;
  picture.lit = { mechanism, dimension };
  panel.lit(mechanism?.key, dimension);
  draw();
}

const connection = new Connection({
  opened() {
    for (const mechanism of mechanisms.values()) mechanism.markers.clear();
    status.textContent = 'connected';
  },

  closed() {
    status.textContent = 'the viewer is gone; trying again';
  },

  scene({ mechanisms: described }) {
    const known = new Map(mechanisms);
    mechanisms.clear();
    for (const one of described) {
      const mechanism = known.get(one.key) ?? new Mechanism(one);
      mechanism.describe(one);
      mechanisms.set(one.key, mechanism);
    }
    document.getElementById('empty').hidden = mechanisms.size > 0;
    show(mechanisms.has(shown) ? shown : '');
  },

  look({ number, mechanism, ...look }) {
    const drawn = mechanisms.get(mechanism) ?? new Mechanism({ key: mechanism, settings: [] });
    mechanisms.set(mechanism, drawn);
    drawn.markers.set(number, { points: new Float32Array(), ...drawn.markers.get(number), look });
    picture.refit(mechanism);
  },

  value({ mechanism, name, value }) {
    const setting = mechanisms.get(mechanism)?.settings.get(name);
    if (!setting) return;
    setting.value = value;
    panel.update(mechanism, name, value);
    if (setting.kind.endsWith('array') || setting.kind === 'bool') show(shown);
    if (!/\.(speed|start)$/.test(name)) picture.refit(mechanism);
  },

  frame(buffer) {
    const numbers = new DataView(buffer);
    const now = performance.now();
    for (let at = 0; at < buffer.byteLength;) {
      const number = numbers.getUint32(at, true);
      const count = numbers.getUint32(at + 4, true);
      for (const mechanism of mechanisms.values()) {
        const marker = mechanism.markers.get(number);
        if (!marker) continue;
        marker.points = new Float32Array(buffer, at + 8, 3 * count);
        if (marker.look.kind !== 'strip') mechanism.heard = now;
      }
      at += 8 + 12 * count;
    }
    draw(() => connection.tell({ op: 'drawn' }));
    frames += 1;
  },
});

const panel = new Panel(document.getElementById('panel'), connection, light);

/** Draw once before the next refresh of the screen, then do what is to be done after it. */
function draw(after) {
  if (scheduled && !after) return;
  scheduled = true;
  requestAnimationFrame(() => {
    scheduled = false;
    picture.draw();
    after?.();
  });
}

function show(key) {
  if (key !== shown) picture.view.reset();
  shown = key;
  const several = mechanisms.size > 1;
  const labels = several
    ? [['', 'all'], ...[...mechanisms.values()].map(one => [one.key, one.name])] : [];
  views.replaceChildren(...labels.map(([value, label]) => {
    const button = document.createElement('button');
    button.textContent = label;
    button.setAttribute('aria-pressed', value === key);
    button.onclick = () => show(value);
    return button;
  }));
  const selected = [...mechanisms.values()].filter(mechanism => !key || mechanism.key === key);
  picture.show(selected);
  panel.show(selected, several && !key);
  naming.hidden = selected.length !== 1 || selected[0].legs > 1;
  draw();
}

names.onchange = () => {
  picture.named = names.checked;
  draw();
};

document.getElementById('workshop').onchange = ({ target }) => {
  units.choose(target.checked);
  draw();
};

new ResizeObserver(() => draw()).observe(picture.canvas);

setInterval(() => {
  if (connection.opened) status.textContent = `${frames} pictures/s`;
  frames = 0;
  panel.check(performance.now());
}, 1000);
