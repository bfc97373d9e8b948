// Copyright 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// A mechanism on the page: its markers by number, its settings by name, and its changes.

import { History } from './history.js';

export class Mechanism {
  constructor(described) {
    this.markers = new Map();
    this.lastMarkers = performance.now();
    /** Ranges and bars of dimensions, and fixed joints; empty until the viewer has answered. */
    this.tunable = { travel: {}, bars: {}, fixed: [] };
    /** The requested kind of arrows, and the received arrows by joint. */
    this.arrows = { kind: '', at: {} };
    this.describe(described);
    this.history = new History(this);
  }

  describe(described) {
    Object.assign(this, described);
    this.settings = new Map(described.settings.map(setting => [setting.name, setting]));
    this.history?.begin();
  }

  /** Store the arrows that were requested, by joint. */
  show(arrows) {
    Object.assign(this.arrows, arrows);
  }

  value(name) {
    return this.settings.get(name)?.value;
  }

  /** Its markers; with mirrored legs, the curve of their feet, too. */
  *drawn() {
    for (const { look, points } of this.markers.values()) {
      yield { look, points };
      if (look.kind === 'strip' && this.value('mirrored')) yield { look, points: points.map((value, i) => i % 3 ? value : -value) };
    }
  }

  /** Whether it is no linkage in a plane. */
  get inSpace() {
    return this.value('type') === 'rods';
  }

  /** How many pairs of legs there are, and how many legs. */
  get pairs() {
    return this.value('leg_pairs') ?? 1;
  }

  get legs() {
    return this.pairs * (this.value('mirrored') ? 2 : 1);
  }
}
