// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// The WebSocket to the viewer; open only while the page is visible.

const RETRY = 1000;
const GONE = { reason: 'the viewer is gone' };

export class Connection {
  constructor(handlers) {
    this.handlers = handlers;
    this.asked = new Map();
    this.next = 1;
    document.addEventListener('visibilitychange', () => document.hidden ? this.close() : this.open());
    this.open();
  }

  get opened() {
    return this.socket?.readyState === WebSocket.OPEN;
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
    for (const answer of this.asked.values()) answer(GONE);
    this.asked.clear();
  }

  tell(message) {
    if (this.opened) this.socket.send(JSON.stringify(message));
  }

  /** Send a request and return its answer, whose reason is empty if the request was granted. */
  ask(message) {
    if (!this.opened) return Promise.resolve(GONE);
    const id = this.next++;
    return new Promise(resolve => {
      this.asked.set(id, resolve);
      this.tell({ ...message, id });
    });
  }
}
