// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The page: passes the viewer's messages to picture and panel, and requests to the viewer.

import { connect, tell } from './connection.js';
import { button, put, units } from './control.js';
import { isTuned, Mechanism } from './mechanism.js';
import { Panel } from './panel.js';
import { Picture } from './picture.js';
import { View } from './pointer.js';

const REFUSED = 4000;
const mechanisms = new Map();
const text = new TextDecoder();
const at = id => document.getElementById(id);
const [views, names, workshop, arrows, whole, notice] = [
  'views', 'names', 'workshop', 'arrows', 'whole', 'notice'].map(at);
/** What a reload keeps. */
const stored = { shown: '', from: {}, names: true, workshop: false, arrows: '', ...JSON.parse(sessionStorage.getItem('kept') ?? '{}') };
let { shown } = stored;
let fading = 0;
/** Whether a picture is to be drawn, and was received. */
let scheduled = false;
let received = false;

const store = values => sessionStorage.setItem('kept', JSON.stringify(Object.assign(stored, values)));

const picture = new Picture(at('picture'));
const panel = new Panel(at('panel'), light, words => say(words, REFUSED));
picture.view = new View(picture, stored.from, {
  changed() {
    whole.hidden = picture.view.whole;
    const { zoom, shift, yaw, pitch } = picture.view;
    store({ from: { zoom, shift, yaw, pitch } });
    draw();
  },
  drag(mechanism, want) {
    panel.sections.get(mechanism.key)?.motion.target.offer(want);
    draw();
  },
  light,
  choose: (mechanism, dimension) => panel.sections.get(mechanism.key)?.tuning.goTo(dimension),
});
whole.hidden = picture.view.whole;
whole.onclick = () => picture.view.reset();

/** Light up the bars of a dimension, and its slider. */
function light(mechanism, dimension) {
  picture.lit = { mechanism, dimension };
  panel.lit(mechanism?.key, dimension);
  draw();
}

/** Show over the picture why it is not available, or for some time why it cannot be moved; an empty text hides it. */
function say(words, time) {
  clearTimeout(fading);
  put(notice, { textContent: words, hidden: !words });
  if (time) fading = setTimeout(say, time, '');
}

connect({
  opened: () => say(mechanisms.size ? '' : 'Loading …'),

  closed: () => say('Connection lost: the viewer is gone. Trying again …'),

  scene({ mechanisms: descriptions }) {
    const known = new Map(mechanisms);
    mechanisms.clear();
    for (const description of descriptions.sort((a, b) => a.key.localeCompare(b.key, 'en', { numeric: true }))) {
      const { key, name } = description;
      const mechanism = known.get(key) ?? new Mechanism();
      mechanism.describe(description);
      // Mechanisms of one name in two namespaces have distinct titles.
      mechanism.title = descriptions.some(other => other.name === name && other.key !== key) ? key.slice(1) : name;
      mechanisms.set(key, mechanism);
    }
    at('empty').hidden = mechanisms.size > 0;
    say('');
    // What was shown before a reload, or before the viewer ended, may be found later.
    show(mechanisms.has(stored.shown) || !mechanisms.size ? stored.shown : '');
  },

  mechanism(description) {
    const { key } = description;
    const changed = mechanisms.get(key)?.describe(description) ?? [];
    for (const setting of changed) panel.sections.get(key)?.update(setting);
    if (changed.some(({ kind }) => kind !== 'double')) show(shown);
    if (changed.some(isTuned)) picture.refit(key);
  },

  /** Frames, each the length of a header, the header, and the points of its markers. */
  picture(buffer) {
    for (let from = 0; from < buffer.byteLength;) {
      const length = new DataView(buffer).getUint32(from, true);
      const { key, topic, markers } = JSON.parse(text.decode(new Uint8Array(buffer, from + 4, length)));
      from += 4 + length;
      for (const marker of markers) {
        const count = 3 * marker.points;
        marker.points = new Float32Array(buffer, from, count);
        from += 4 * count;
      }
      const mechanism = mechanisms.get(key);
      if (!mechanism) continue;
      // The scale does not depend on what comes first, the markers or the locus.
      if (!mechanism.markers.has(topic)) picture.refit(key);
      mechanism.markers.set(topic, markers);
      if (topic === 'markers') mechanism.lastMarkers = performance.now();
    }
    panel.follow();
    received = true;
    draw();
  },
});

/** Draw once before the next refresh of the screen. */
function draw() {
  if (scheduled) return;
  scheduled = true;
  requestAnimationFrame(() => {
    scheduled = false;
    // What cannot be drawn does not keep the next picture away.
    if (received) tell('drawn');
    received = false;
    picture.draw();
  });
}

function show(key) {
  if (key !== shown) picture.view.reset();
  shown = key;
  const several = mechanisms.size > 1;
  const labels = several ? [['', 'all'], ...[...mechanisms.values()].map(({ key: value, title }) => [value, title])] : [];
  views.replaceChildren(...labels.map(([value, title]) => button(title, () => {
    store({ shown: value });
    show(value);
  }, { ariaPressed: value === key })));
  const selected = [...mechanisms.values()].filter(mechanism => !key || mechanism.key === key);
  picture.show(selected);
  panel.show(selected, several && !key);
  names.parentElement.hidden = selected.length !== 1 || selected[0].legs.length > 1;
  arrows.parentElement.hidden = selected.every(({ space }) => space);
  draw();
}

/** Apply the options above the picture, and save them for a reload. */
function choose() {
  store({ names: names.checked, workshop: workshop.checked, arrows: arrows.value });
  Object.assign(picture, { named: names.checked, kind: arrows.value });
  Object.assign(panel, { arrows: arrows.value });
  units.workshop = workshop.checked;
  for (const mechanism of mechanisms.values()) mechanism.arrows = { at: {} };
  panel.render();
  draw();
}

[names.checked, workshop.checked, arrows.value] = [stored.names, stored.workshop, stored.arrows];
names.onchange = workshop.onchange = arrows.onchange = choose;
choose();

new ResizeObserver(() => draw()).observe(picture.canvas);
