// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// Downloads of a mechanism: its outputs, its picture, its robot model, its C code.

import { button, element, Reason } from './control.js';

const FORMS = {
  CSV: ['csv', 'All outputs over a turn or a stroke, in radians and metres, the input at 1 rad/s or 1 m/s'],
  PNG: ['png', 'The present view'],
  URDF: ['urdf', 'The robot model'],
  C: ['h', 'A C99 header for a microcontroller'],
};

/** What there is of a linkage in space. */
const IN_SPACE = ['PNG', 'C'];

/** Let the browser save blobs or texts as a file. */
export function download(name, ...parts) {
  const href = URL.createObjectURL(new Blob(parts));
  element('a', { download: name, href }).click();
  setTimeout(() => URL.revokeObjectURL(href), 1000);
}

const picture = () => new Promise(done => { document.getElementById('picture').toBlob(done); });

/** The buttons that download. */
export function files(mechanism) {
  const reason = new Reason();
  const save = async (form, ending) => {
    const { reason: why, text } = form === 'PNG' ? { text: await picture() } : await mechanism.ask('export', { form: form.toLowerCase() });
    reason.say(why && `Not saved: ${why}`);
    if (text) download(`${mechanism.name}.${ending}`, text);
  };
  return element('div', { className: 'tools' }, element('span', { className: 'about', textContent: 'Download' }),
    ...Object.entries(FORMS).filter(([form]) => !mechanism.space || IN_SPACE.includes(form)).map(([form, [ending, title]]) => button(form, () => save(form, ending), { title })), reason.line);
}
