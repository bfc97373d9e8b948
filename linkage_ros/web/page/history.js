// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// Changes of a mechanism's parameters, for undo and reset.

const TUNED = ['dimensions', 'branches', 'more'];

export class History {
  constructor(mechanism) {
    Object.assign(this, { mechanism, steps: [], first: new Map() });
  }

  /** Store the first value of each parameter, except speeds and starts. */
  begin() {
    for (const { name, value } of TUNED.flatMap(group => this.mechanism.group(group))) {
      if (!this.first.has(name)) this.first.set(name, value);
    }
  }

  /** Store a value before a change; all changes of one gesture are one step. */
  remember(name, value, gesture) {
    const last = this.steps.at(-1);
    if (!this.first.has(name) || last?.name === name && last.gesture === gesture) return;
    this.steps.push({ name, gesture, values: { [name]: value } });
  }

  /** The values that restore the first ones, and those that undo this. */
  changes() {
    const changed = [...this.first].filter(([name, value]) => this.mechanism.value(name) !== value);
    return [changed, changed.map(([name]) => [name, this.mechanism.value(name)])].map(pairs => Object.fromEntries(pairs));
  }
}
