// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The WebSocket to the viewer; open only while the page is visible.

const RETRY = 1000;
const GONE = { reason: 'the viewer is gone' };
const requests = new Map();
let handlers = null;
let socket = null;
let id = 0;

function close() {
  const old = socket;
  socket = null;
  old?.close();
  for (const answer of requests.values()) answer(GONE);
  requests.clear();
}

function open() {
  if (document.hidden || socket) return;
  const opened = socket = new WebSocket(`ws${location.protocol.slice(4)}//${location.host}/socket`);
  opened.binaryType = 'arraybuffer';
  opened.onmessage = ({ data }) => {
    if (data instanceof ArrayBuffer) return handlers.picture(data);
    const message = JSON.parse(data);
    if (message.op !== 'answer') return handlers[message.op](message);
    requests.get(message.id)?.(message);
    requests.delete(message.id);
  };
  opened.onopen = () => handlers.opened();
  opened.onclose = () => {
    if (socket !== opened) return;
    close();
    handlers.closed();
    setTimeout(open, RETRY);
  };
}

/** Connect, whenever the page is visible; handlers are named as the messages, `picture` for a binary one. */
export function connect(receivers) {
  handlers = receivers;
  document.addEventListener('visibilitychange', () => document.hidden ? close() : open());
  open();
}

export const isOpen = () => socket?.readyState === WebSocket.OPEN;

export function tell(message) {
  if (isOpen()) socket.send(JSON.stringify(message));
}

/** Send a request and return its answer, whose reason is empty if the request was granted. */
export function ask(message) {
  if (!isOpen()) return Promise.resolve(GONE);
  id += 1;
  tell({ ...message, id });
  return new Promise(resolve => { requests.set(id, resolve); });
}
