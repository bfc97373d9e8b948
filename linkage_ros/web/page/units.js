// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

// Units: values are in radians and metres; they are displayed so, or in degrees and millimetres.

import { ask } from './connection.js';

const WORKSHOP = { rad: ['°', 180 / Math.PI], m: ['mm', 1000] };
/** How many characters a field shows. */
const ROOM = 9;

export const units = {
  workshop: false,

  /** The displayed unit for one such as 'rad', 'm/s', 'rad/m', and its factor. */
  of(unit) {
    if (!this.workshop || !unit) return { name: unit, factor: 1 };
    const [over, under = ['', 1]] = unit.split('/').map(part => WORKSHOP[part] ?? [part, 1]);
    return { name: unit.includes('/') ? `${over[0]}/${under[0]}` : over[0], factor: over[1] / under[1] };
  },
};

/** A number of at most so many figures that has room in a field. */
export function figures(value, most) {
  for (let digits = most; digits > 1; digits--) {
    const number = Number(value.toPrecision(digits));
    const short = [String(number), number.toExponential().replace('+', '')].find(text => text.length <= ROOM);
    if (short) return short;
  }
  return value.toExponential(0).replace('+', '');
}

/** The value [rad or m] of a text in a displayed unit, `factor` times smaller; or the reason why it has none. */
export async function read(text, unit, factor) {
  const { value, turns, reason } = await ask({ op: 'read', text });
  return reason ? { reason } : { value: turns && unit?.startsWith('rad') ? value : value / factor };
}
