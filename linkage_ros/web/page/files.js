// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// Downloads of a mechanism: its outputs, its picture, its robot model, its C code.

import { button, element, Reason } from './control.js';
import { paint } from './picture.js';

const FORMS = {
  CSV: ['csv', 'All outputs over a turn or a stroke, in radians and metres, the input at 1 rad/s or 1 m/s'],
  PNG: ['png', 'The present view'],
  URDF: ['urdf', 'The robot model'],
  C: ['h', 'A C99 header for a microcontroller'],
};

/** Let the browser save blobs or texts as a file. */
export function download(name, ...parts) {
  const href = URL.createObjectURL(new Blob(parts));
  element('a', { download: name, href }).click();
  setTimeout(() => URL.revokeObjectURL(href), 1000);
}

/** The picture on its paper. */
function painted() {
  const seen = document.getElementById('picture');
  const { width, height } = seen;
  const canvas = element('canvas', { width, height });
  const context = canvas.getContext('2d');
  context.fillStyle = paint('--paper');
  context.fillRect(0, 0, width, height);
  context.drawImage(seen, 0, 0);
  return new Promise(done => { canvas.toBlob(done); });
}

export class Files {
  constructor(mechanism) {
    Object.assign(this, { mechanism, reason: new Reason() });
    this.element = element('div', { className: 'tools' }, element('span', { className: 'about', textContent: 'Download' }),
      ...Object.entries(FORMS).map(([form, [ending, title]]) => button(form, () => this.save(form.toLowerCase(), ending), { title })),
      this.reason.line);
  }

  async save(form, ending) {
    const { reason, text } = form === 'png' ? { text: await painted() } : await this.mechanism.ask('export', { form });
    this.reason.say(reason && `Not saved: ${reason}`);
    if (!reason) download(`${this.mechanism.name}.${ending}`, text);
  }
}
