// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// What was changed of a mechanism, to be undone.

const MOVES = /\.(speed|start)$/;

export class History {
  constructor(mechanism) {
    this.mechanism = mechanism;
    this.steps = [];
    this.first = new Map();
    this.begin();
  }

  /** Remember the values that a mechanism has when it is first seen; how it moves is none. */
  begin() {
    for (const { name, kind, value, fixed } of this.mechanism.settings.values()) {
      const tuned = !fixed && !MOVES.test(name) && ['double', 'integer', 'bool'].includes(kind);
      if (tuned && !this.first.has(name)) this.first.set(name, value);
    }
  }

  /** Remember a value before it is changed; all changes of one gesture are one step. */
  remember(name, value, gesture) {
    const last = this.steps.at(-1);
    if (!this.first.has(name) || last?.name === name && last.gesture === gesture) return;
    this.steps.push({ name, gesture, values: { [name]: value } });
  }

  /** What brings the first values back, and what undoes that. */
  changes() {
    const changed = [...this.first].filter(([name, value]) => this.mechanism.value(name) !== value);
    return [changed, changed.map(([name]) => [name, this.mechanism.value(name)])].map(pairs => Object.fromEntries(pairs));
  }
}
