// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// A mechanism on the page: its description, its markers by number, and its changes.

import { History } from './history.js';

/** What is drawn of a mechanism whose parameters are not announced yet. */
const UNKNOWN = { settings: [], points: [], legs: 1, pairs: 1, inputs: {}, sides: {}, curves: {} };

export class Mechanism {
  constructor(described, connection) {
    this.connection = connection;
    this.markers = new Map();
    this.lastMarkers = performance.now();
    /** Ranges and bars of dimensions, and fixed joints; empty until the viewer has answered. */
    this.tunable = { travel: {}, bars: {}, fixed: [] };
    /** The requested kind of arrows, and the received arrows by joint. */
    this.arrows = { kind: '', at: {} };
    this.history = new History(this);
    this.describe(described);
  }

  describe(described) {
    Object.assign(this, UNKNOWN, described);
    this.settings = new Map(this.settings.map(setting => [setting.name, setting]));
    this.history.begin();
  }

  /** Request something of the mechanism; return the answer. */
  ask(op, fields) {
    return this.connection.ask({ op, mechanism: this.key, ...fields });
  }

  value(name) {
    return this.settings.get(name)?.value;
  }

  /** The settings of a group: dimensions, branches, speeds, starts or more. */
  group(name) {
    return [...this.settings.values()].filter(({ group }) => group === name);
  }

  /** The width of a bar [m], which is half of a joint's. */
  get width() {
    return [...this.markers.values()].find(({ look }) => look.kind === 'joints')?.look.width / 2;
  }
}
