// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The page: what the viewer sends goes into the picture and the panel, what is dragged goes back.

import { Panel } from './panel.js';
import { Picture } from './picture.js';

const RETRY = 1000;

/** The WebSocket to the viewer; open only while the page can be seen. */
class Connection {
  constructor(handlers) {
    this.handlers = handlers;
    this.asked = new Map();
    this.next = 1;
    document.addEventListener('visibilitychange', () => document.hidden ? this.close() : this.open());
    this.open();
  }

  open() {
    if (document.hidden || this.socket) return;
    const socket = this.socket = new WebSocket(`ws${location.protocol.slice(4)}//${location.host}/socket`);
    socket.binaryType = 'arraybuffer';
    socket.onmessage = ({ data }) => {
      if (data instanceof ArrayBuffer) return this.handlers.frame(data);
      const message = JSON.parse(data);
      if (message.op !== 'answer') return this.handlers[message.op](message);
      this.asked.get(message.id)?.(message);
      this.asked.delete(message.id);
    };
    socket.onopen = () => this.handlers.opened();
    socket.onclose = () => {
      if (this.socket !== socket) return;
      this.close();
      this.handlers.closed();
      setTimeout(() => this.open(), RETRY);
    };
  }

  close() {
    const socket = this.socket;
    this.socket = null;
    socket?.close();
    for (const answer of this.asked.values()) answer({ reason: 'the viewer is gone' });
    this.asked.clear();
  }

  tell(message) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  /** Ask for something; the answer's reason is empty where it was granted. */
  ask(message) {
    if (this.socket?.readyState !== WebSocket.OPEN) return Promise.resolve({ reason: 'the viewer is gone' });
    const id = this.next++;
    return new Promise(resolve => {
      this.asked.set(id, resolve);
      this.tell({ ...message, id });
    });
  }
}

/** A mechanism as it is drawn: its markers by number, its settings by name. */
class Mechanism {
  constructor(described) {
    this.markers = new Map();
    this.heard = performance.now();
    this.describe(described);
  }

  describe(described) {
    Object.assign(this, described);
    this.settings = new Map(described.settings.map(setting => [setting.name, setting]));
  }

  value(name) {
    return this.settings.get(name)?.value;
  }

  /** How many pairs of legs there are, and how many legs. */
  get pairs() {
    return this.value('leg_pairs') ?? 1;
  }

  get legs() {
    return this.pairs * (this.value('mirrored') ? 2 : 1);
  }
}

const mechanisms = new Map();
const views = document.getElementById('views');
const status = document.getElementById('status');
const names = document.getElementById('names');
const naming = names.closest('label');
let shown = '';
let scheduled = false;
let frames = 0;

const picture = new Picture(document.getElementById('picture'), {
  drag: (mechanism, angle) => panel.drag(mechanism.key, angle),
});

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

const panel = new Panel(document.getElementById('panel'), connection);

/** Draw once before the next refresh of the screen, then do what is to be done after it. */
function draw(after) {
  if (scheduled && !after) return;
  scheduled = true;
  requestAnimationFrame(() => {
    scheduled = false;
    picture.draw();
    panel.follow(picture.levers());
    after?.();
  });
}

function show(key) {
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

new ResizeObserver(() => draw()).observe(picture.canvas);

setInterval(() => {
  if (connection.socket?.readyState === WebSocket.OPEN) status.textContent = `${frames} pictures/s`;
  frames = 0;
  panel.check(performance.now());
}, 1000);
