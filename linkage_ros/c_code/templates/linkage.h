// Copyright 2026 linkage_ros contributors
//
// Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
// in compliance with the License. You may obtain a copy of the License at
// http://www.apache.org/licenses/LICENSE-2.0
// Unless required by applicable law or agreed to in writing, software distributed under the
// License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
// express or implied. See the License for the specific language governing permissions and
// limitations under the License.

/*
 * What the headers of all linkages have in common.
 *
 * A generated header has the formulas and tables of one linkage; here is how they are used: the
 * inverse, and the conversion between actuators and joints. C99 and C++17 without heap, lock,
 * recursion or exception; every loop is bounded. Compile without -ffast-math, which drops the checks.
 */
#ifndef LINKAGE_ROS_LINKAGE_H
#define LINKAGE_ROS_LINKAGE_H

#include <float.h>
#include <math.h>
#include <string.h>

/* The most inputs of a linkage in this program, and whether it computes in float. */
#ifndef LINKAGE_MAX_INPUTS
#define LINKAGE_MAX_INPUTS 6
#endif
#ifndef LINKAGE_FLOAT
#define LINKAGE_FLOAT 0
#endif

#if LINKAGE_FLOAT
typedef float linkage_real;
#define linkage_abs fabsf
#define linkage_floor floorf
#define linkage_sqrt sqrtf
#define linkage_atan2 atan2f
/* A Jacobian below this part of its size is singular: for velocities, and for Newton's method. */
#define LINKAGE_SINGULAR 1e-3f
#define LINKAGE_LEAST 1e-5f
/* Newton's method ends at ENOUGH, and may leave CLOSE, times the rate or STEEPEST [rad, sizes]. */
#define LINKAGE_ENOUGH 2e-6f
#define LINKAGE_CLOSE 4e-6f
#define LINKAGE_STEEPEST 1e3f
/* An input may be beyond an end of the reach by SLACK; it is taken further inside by INSIDE. */
#define LINKAGE_SLACK 1e-5f
#define LINKAGE_INSIDE 2e-6f
#else
#if DBL_MANT_DIG < 53
#error "double is a float on this machine: print the header again with --float"
#endif
typedef double linkage_real;
#define linkage_abs fabs
#define linkage_floor floor
#define linkage_sqrt sqrt
#define linkage_atan2 atan2
#define LINKAGE_SINGULAR 1e-6
#define LINKAGE_LEAST 1e-12
#define LINKAGE_ENOUGH 1e-14
#define LINKAGE_CLOSE 1e-13
#define LINKAGE_STEEPEST 4e6
#define LINKAGE_SLACK 1e-9
#define LINKAGE_INSIDE 1e-14
#endif

/* Poses of Newton's method: from a closed form, and of a search in a piece of the reach. */
#define LINKAGE_CLOSED_POSES 4
#define LINKAGE_SEARCH_POSES 64
/* States that are tried for a first pose. */
#define LINKAGE_SAMPLES 4096
#define LINKAGE_NAN ((linkage_real)NAN)
/* A closed form that misses by more than this belongs to another assembly [rad, sizes]. */
#define LINKAGE_OTHER ((linkage_real)0.01)
/* Half, in a form that both kinds of numbers have. */
#define LINKAGE_HALF ((linkage_real)0.5)

/* Formulas are inlined wherever a pose is needed, so that only what is used there is computed. */
#ifdef __GNUC__
#define LINKAGE_FORMULA static inline __attribute__((always_inline))
#define LINKAGE_PURE static __attribute__((const, noinline, unused))
/* Farther than anything: where that is infinite, a compiler leaves out what asks for it. */
#define LINKAGE_FAR ((linkage_real)INFINITY)
#else
#define LINKAGE_FAR ((linkage_real)1e30)
#define LINKAGE_FORMULA static inline
#define LINKAGE_PURE static inline
#endif

/* --- numbers --- */

/* The larger and the smaller one, quicker than fmax and fmin; b is left out if it is NaN. */
static inline linkage_real linkage_max(linkage_real a, linkage_real b)
{
    return b > a ? b : a;
}

static inline linkage_real linkage_min(linkage_real a, linkage_real b)
{
    return b < a ? b : a;
}

/* Whether x is more than half a turn, if there are turns. */
LINKAGE_FORMULA int linkage_is_beyond(linkage_real x, linkage_real turn)
{
    return turn > 0 && linkage_abs(x) > turn / 2;
}

/* The whole turns nearest to x; a compiler divides where it compiles. */
LINKAGE_FORMULA linkage_real linkage_turns(linkage_real x, linkage_real turn)
{
    return turn * linkage_floor(x * (1 / turn) + LINKAGE_HALF);
}

/* x without whole turns, if there are any. */
LINKAGE_FORMULA linkage_real linkage_wrapped(linkage_real x, linkage_real turn)
{
    return linkage_is_beyond(x, turn) ? x - linkage_turns(x, turn) : x;
}

/* A limit that is missed by rounding counts as reached. */
static inline linkage_real linkage_root(linkage_real x, linkage_real tolerance)
{
    if (x > 0) {
        return linkage_sqrt(x);
    }
    return x >= -tolerance ? 0 : LINKAGE_NAN;
}

static inline linkage_real linkage_gated(linkage_real x, linkage_real margin, linkage_real tolerance)
{
    return margin >= -tolerance ? x : LINKAGE_NAN;
}

/* The angle of (x, y); a compiler leaves it out where it is not used. */
LINKAGE_PURE linkage_real linkage_angle(linkage_real y, linkage_real x)
{
    return linkage_atan2(y, x);
}

/* --- types --- */

enum { LINKAGE_ACTUATORS = 0, LINKAGE_JOINTS = 1 };

/* Status of a call: 0, or a sum of these. OUT_OF_REACH: outside the reach or the sweep. SINGULAR: a
   velocity or an effort would be infinite. NOT_KNOWN: a value is NaN or infinite, which of a command
   means that there is none. */
enum { LINKAGE_OK = 0, LINKAGE_OUT_OF_REACH = 1, LINKAGE_SINGULAR_POSE = 2, LINKAGE_NOT_KNOWN = 4 };

/* Positions, velocities and efforts of the actuators, or of the joints. */
typedef struct {
    linkage_real position[LINKAGE_MAX_INPUTS];
    linkage_real velocity[LINKAGE_MAX_INPUTS];
    linkage_real effort[LINKAGE_MAX_INPUTS];
} linkage_side;

/* A pose: positions of the actuators [0] and joints [1], their rates by each input, and the inputs'
   efforts against the loads. */
typedef struct {
    linkage_real position[2][LINKAGE_MAX_INPUTS];
    linkage_real rate[2][LINKAGE_MAX_INPUTS][LINKAGE_MAX_INPUTS];
    linkage_real load[LINKAGE_MAX_INPUTS];
} linkage_point;

/* The place of an actuator or a joint in a linkage. */
typedef struct {
    const char *name;
    /* One over the size of its position, and what it may change by without effect, or 0. */
    linkage_real scale, turn;
    /* If it counts the turns of an input: the input, the rate by it, and the position where that is 0.
       Otherwise the rate is 0. */
    int input;
    linkage_real rate, zero;
} linkage_axis;

/* An input, in rad or in its size: after how much poses repeat, or 0; its start, the range of its
   samples, their step, and its sweep. */
typedef struct {
    linkage_real turn, start, low, width, step;
    linkage_real sweep[2];
} linkage_input;

/* A linkage. Inputs q are in rad or in sizes. */
typedef struct {
    int inputs;
    /* Whether the pose of an inverse is to have rates and loads. */
    int is_rated;
    /* The pose at inputs, with rates and loads or without; 0 if it cannot be assembled. */
    int (*at)(const linkage_real *q, int is_rated, linkage_point *p);
    linkage_axis axis[2][LINKAGE_MAX_INPUTS];
    linkage_input input[LINKAGE_MAX_INPUTS];
    /* After how much of each input the actuators or the joints repeat, or 0. */
    linkage_real turn[2][LINKAGE_MAX_INPUTS];
    /* The reach of its only input, if it has ends: middles of arcs and half their lengths. */
    int arcs;
    const linkage_real (*arc)[2];
} linkage_model;

/* From positions of actuators or joints to the inputs nearest to q, and the pose there. */
typedef int linkage_inverse(const linkage_real *position, linkage_real *q, linkage_point *p);

/* What an inverse looks for: positions and near inputs without the whole turns that are counted. */
typedef struct {
    linkage_real to[LINKAGE_MAX_INPUTS];
    linkage_real near[LINKAGE_MAX_INPUTS];
    linkage_real whole[LINKAGE_MAX_INPUTS];
} linkage_goal;

/* Inputs from which a goal may be reached, and how far they are from the near ones, or -1. */
typedef struct {
    linkage_real q[LINKAGE_MAX_INPUTS];
    linkage_real away;
} linkage_start;

/* A part of the reach in which a position only rises, or only falls: both ends. */
typedef struct {
    linkage_real q[2];
    linkage_real position[2];
} linkage_piece;

/* The state between calls: the last poses and inputs by measured actuators [0] and by commanded
   joints [1], which of them is newer, and whether there is one; what is held: the actuators [0] where
   they were last commanded or measured, whichever is newer, and the joints [1] where they were last
   measured. NaN was never there. */
typedef struct {
    linkage_point point[2];
    linkage_real q[2][LINKAGE_MAX_INPUTS];
    int newer, is_known;
    linkage_side held[2];
} linkage_memory;

/* --- a pose and positions --- */

/* Gaps from a pose to positions, the shorter way round; returns the largest, in sizes. */
static inline linkage_real linkage_gap(const linkage_model *model, int side, const linkage_real *to,
    const linkage_point *p, linkage_real *gap)
{
    linkage_real most = 0;
    int i;
    for (i = 0; i < model->inputs; i++) {
        const linkage_axis *axis = &model->axis[side][i];
        gap[i] = linkage_wrapped(to[i] - p->position[side][i], axis->turn);
        most = linkage_max(most, linkage_abs(gap[i]) * axis->scale);
    }
    return most;
}

/* Solve a x = b in place, b in x; returns the determinant's sign, 0 where a is singular. */
static inline int linkage_solve(int size, linkage_real least,
    linkage_real a[LINKAGE_MAX_INPUTS][LINKAGE_MAX_INPUTS], linkage_real *x)
{
    /* A compiler knows this bound. */
    const int n = size < LINKAGE_MAX_INPUTS ? size : LINKAGE_MAX_INPUTS;
    linkage_real most = 1;
    int i, j, k, sign = 1;
    for (i = 0; i < n; i++) {
        for (j = 0; j < n; j++) {
            if (!isfinite(a[i][j])) {
                return 0;
            }
            most = linkage_max(most, linkage_abs(a[i][j]));
        }
    }
    for (k = 0; k < n; k++) {
        linkage_real pivot;
        int best = k;
        for (i = k + 1; i < n; i++) {
            best = linkage_abs(a[i][k]) > linkage_abs(a[best][k]) ? i : best;
        }
        if (!(linkage_abs(a[best][k]) > least * most)) {
            return 0;
        }
        for (j = k; j < n; j++) {
            const linkage_real swapped = a[k][j];
            a[k][j] = a[best][j];
            a[best][j] = swapped;
        }
        pivot = x[best];
        x[best] = x[k];
        x[k] = pivot;
        sign = (best == k) == (a[k][k] > 0) ? sign : -sign;
        for (i = k + 1; i < n; i++) {
            const linkage_real factor = a[i][k] / a[k][k];
            for (j = k; j < n; j++) {
                a[i][j] -= factor * a[k][j];
            }
            x[i] -= factor * x[k];
        }
    }
    for (i = n - 1; i >= 0; i--) {
        for (j = i + 1; j < n; j++) {
            x[i] -= a[i][j] * x[j];
        }
        x[i] /= a[i][i];
        if (!isfinite(x[i])) {
            return 0;
        }
    }
    return sign;
}

/* The change of the inputs for a change of positions; returns as linkage_solve. */
static inline int linkage_input_change(const linkage_model *model, int side, const linkage_point *p,
    linkage_real least, const linkage_real *change, linkage_real *x)
{
    linkage_real a[LINKAGE_MAX_INPUTS][LINKAGE_MAX_INPUTS];
    int i, j;
    for (i = 0; i < model->inputs; i++) {
        const linkage_real scale = model->axis[side][i].scale;
        for (j = 0; j < model->inputs; j++) {
            a[i][j] = p->rate[side][i][j] * scale;
        }
        x[i] = change[i] * scale;
    }
    return linkage_solve(model->inputs, least, a, x);
}

/* Whether a pose at inputs q misses positions by rounding only: of the inputs, where it moves fast. */
static inline int linkage_is_at(const linkage_model *model, int side, const linkage_point *p,
    const linkage_real *q, linkage_real left)
{
    linkage_real steepest = 1;
    int i, j;
    for (i = 0; i < model->inputs; i++) {
        for (j = 0; j < model->inputs; j++) {
            const linkage_real rate = linkage_abs(p->rate[side][i][j]) * model->axis[side][i].scale;
            steepest = linkage_max(steepest, rate * linkage_max(1, linkage_abs(q[j])));
        }
    }
    /* At an end of the reach the rate is infinite, yet rounding is not. */
    return left <= LINKAGE_CLOSE * linkage_min(steepest, LINKAGE_STEEPEST);
}

/* --- the inverse --- */

/* What to look for; returns 0 if a position is not finite. */
static inline int linkage_aim(const linkage_model *model, int side, const linkage_real *position,
    const linkage_real *q, linkage_goal *goal)
{
    int i;
    for (i = 0; i < model->inputs; i++) {
        goal->near[i] = q[i];
        goal->whole[i] = 0;
    }
    for (i = 0; i < model->inputs; i++) {
        const linkage_axis *axis = &model->axis[side][i];
        if (!isfinite(position[i])) {
            return 0;
        }
        goal->to[i] = position[i];
        if (axis->rate != 0) {
            /* It tells the input; whole turns are taken away, so that they cost no digits. */
            const int k = axis->input;
            const linkage_real turn = model->input[k].turn;
            goal->near[k] = (position[i] - axis->zero) / axis->rate;
            if (linkage_is_beyond(goal->near[k], turn)) {
                goal->whole[k] = linkage_turns(goal->near[k], turn);
                goal->to[i] -= axis->rate * goal->whole[k];
            }
        }
    }
    return 1;
}

/* Whether an input is in its reach, or beyond an end by rounding. */
static inline int linkage_is_within(const linkage_model *model, linkage_real q, linkage_real *inside)
{
    int i;
    for (i = 0; i < model->arcs; i++) {
        const linkage_real gap = linkage_wrapped(q - model->arc[i][0], model->input[0].turn);
        const linkage_real over = linkage_abs(gap) - model->arc[i][1];
        if (over <= LINKAGE_SLACK) {
            *inside = q;
            if (over > 0) {
                *inside += gap > 0 ? -over : over;
            }
            return 1;
        }
    }
    return 0;
}

/* Add the whole turns to x that bring it nearest to the goal; returns how far it is from there, -1 if
   not allowed. A command has to be in the sweeps. What is measured may be outside, which counts ten
   times more. */
static inline linkage_real linkage_bring(const linkage_model *model, int side,
    const linkage_goal *goal, const linkage_real *x, linkage_real *q)
{
    linkage_real away = 0;
    int i;
    for (i = 0; i < model->inputs; i++) {
        const linkage_real low = model->input[i].sweep[0];
        const linkage_real high = model->input[i].sweep[1];
        const linkage_real turn = model->turn[side][i];
        linkage_real near = goal->near[i];
        if (side == LINKAGE_JOINTS) {
            near = linkage_min(linkage_max(near, low), high);
        }
        q[i] = x[i] + goal->whole[i];
        if (linkage_is_beyond(near - q[i], turn)) {
            q[i] += linkage_turns(near - q[i], turn);
        }
        if (side == LINKAGE_JOINTS && q[i] < low) {
            q[i] += turn;
        } else if (side == LINKAGE_JOINTS && q[i] > high) {
            q[i] -= turn;
        }
        if (q[i] < low || q[i] > high) {
            if (side == LINKAGE_JOINTS) {
                return -1;
            }
            away += 10 * linkage_max(low - q[i], q[i] - high);
        }
        away += linkage_abs(q[i] - goal->near[i]);
    }
    return isfinite(away) ? away : -1;
}

/* Give the positions of a pose at x the whole turns of q. */
static inline void linkage_count_turns(const linkage_model *model, const linkage_real *x,
    const linkage_real *q, linkage_point *p)
{
    int side, i;
    for (side = LINKAGE_ACTUATORS; side <= LINKAGE_JOINTS; side++) {
        for (i = 0; i < model->inputs; i++) {
            const linkage_axis *axis = &model->axis[side][i];
            if (axis->rate != 0) {
                p->position[side][i] += axis->rate * (q[axis->input] - x[axis->input]);
            }
        }
    }
}

/* Newton's method from a rated pose at inputs q that misses positions by gaps, of which `left` is the
   largest: each step comes nearer, and stays on its side of singular poses. Returns 0, with any q, if
   it does not get there. */
static inline int linkage_refine(const linkage_model *model, int side, const linkage_real *to,
    linkage_real left, linkage_real *gap, linkage_real *q, linkage_point *p)
{
    linkage_point next;
    linkage_real moved[LINKAGE_MAX_INPUTS];
    linkage_real x[LINKAGE_MAX_INPUTS], y[LINKAGE_MAX_INPUTS];
    linkage_real share = 1;
    int sign = linkage_input_change(model, side, p, LINKAGE_LEAST, gap, x);
    int i, step;
    for (step = 1; step < LINKAGE_CLOSED_POSES && sign != 0 && left > LINKAGE_ENOUGH; step++) {
        linkage_real now = left;
        linkage_real longest = LINKAGE_HALF;
        int other = 0;
        for (i = 0; i < model->inputs; i++) {
            longest = linkage_max(longest, linkage_abs(x[i]));
        }
        for (i = 0; i < model->inputs; i++) {
            moved[i] = q[i] + share * LINKAGE_HALF / longest * x[i];
        }
        if (model->at(moved, 1, &next)) {
            now = linkage_gap(model, side, to, &next, gap);
        }
        if (now < left) {
            other = linkage_input_change(model, side, &next, LINKAGE_LEAST, gap, y);
        }
        if (now < left && (other == sign || now <= LINKAGE_CLOSE)) {
            *p = next;
            left = now;
            sign = other;
            share = 1;
            for (i = 0; i < model->inputs; i++) {
                q[i] = moved[i];
                x[i] = y[i];
            }
        } else if (left <= LINKAGE_CLOSE) {
            break;
        } else {
            share /= 2;
        }
    }
    return linkage_is_at(model, side, p, q, left);
}

/* From a start to positions; returns 0 if they are not reached in this assembly. */
static inline int linkage_reach(const linkage_model *model, int side, const linkage_goal *goal,
    linkage_real most, linkage_real *x, linkage_point *p)
{
    linkage_real gap[LINKAGE_MAX_INPUTS];
    linkage_real left;
    /* A start may be beyond an end of the reach by rounding. */
    if (!model->at(x, model->is_rated, p)
        && !(model->arcs > 0 && linkage_is_within(model, x[0], &x[0]) && model->at(x, model->is_rated, p))) {
        return 0;
    }
    left = linkage_gap(model, side, goal->to, p, gap);
    if (left <= LINKAGE_ENOUGH) {
        return 1;
    }
    return left <= most && (model->is_rated || model->at(x, 1, p))
        && linkage_refine(model, side, goal->to, left, gap, x, p);
}

/* The inputs nearest to those of the goal, of `count` starts; what an axis counts is known. If none
   leads there, by Newton's method from the near ones, for which there is one more start. */
static inline int linkage_choose(const linkage_model *model, int side, const linkage_goal *goal,
    int count, linkage_start *start, linkage_real *q, linkage_point *p)
{
    linkage_real inside;
    int i, k;
    for (k = 0; k < count; k++) {
        for (i = 0; i < model->inputs; i++) {
            const linkage_axis *axis = &model->axis[side][i];
            if (axis->rate != 0) {
                start[k].q[axis->input] = goal->near[axis->input] - goal->whole[axis->input];
            }
        }
        start[k].away = linkage_bring(model, side, goal, start[k].q, q);
        if (model->arcs > 0 && !linkage_is_within(model, start[k].q[0], &inside)) {
            start[k].away = -1;
        }
    }
    for (i = 0; i < model->inputs; i++) {
        start[count].q[i] = linkage_wrapped(goal->near[i] - goal->whole[i], model->input[i].turn);
    }
    start[count].away = LINKAGE_FAR;
    for (;;) {
        linkage_start *nearest = 0;
        linkage_real most;
        for (k = 0; k <= count; k++) {
            if (start[k].away >= 0 && (!nearest || start[k].away < nearest->away)) {
                nearest = &start[k];
            }
        }
        if (!nearest) {
            return 0;
        }
        most = nearest == &start[count] ? LINKAGE_FAR : LINKAGE_OTHER;
        nearest->away = -1;
        if (linkage_reach(model, side, goal, most, nearest->q, p)
            && linkage_bring(model, side, goal, nearest->q, q) >= 0) {
            linkage_count_turns(model, nearest->q, q, p);
            return 1;
        }
    }
}

/* Search a position in a piece of the reach, by Newton's method between brackets. */
static inline int linkage_search_piece(const linkage_model *model, int side,
    const linkage_piece *piece, linkage_real position, linkage_real near, linkage_real *x,
    linkage_point *p)
{
    const linkage_real range = piece->position[1] - piece->position[0];
    const linkage_real middle = (piece->q[0] + piece->q[1]) / 2;
    const linkage_real scale = model->axis[side][0].scale;
    linkage_real low = piece->q[0];
    linkage_real high = piece->q[1];
    linkage_real left = LINKAGE_FAR;
    linkage_real gap, inside, next;
    int step;
    p->position[side][0] = (piece->position[0] + piece->position[1]) / 2;
    (void)linkage_gap(model, side, &position, p, &gap);
    inside = (linkage_abs(range) / 2 - linkage_abs(gap)) * scale;
    if (!(inside >= -LINKAGE_CLOSE)) {
        return 0;
    }
    next = low + (high - low) * (LINKAGE_HALF + gap / range);
    near = middle + linkage_wrapped(near - middle, model->turn[side][0]);
    if (inside <= LINKAGE_CLOSE) {
        next = next > middle ? high : low;
    } else if (near > low && near < high) {
        next = near;
    }
    for (step = 0; step < LINKAGE_SEARCH_POSES; step++) {
        const linkage_real before = left;
        int is_at = 0;
        *x = next;
        if (!model->at(x, 1, p)) {
            /* Beyond an end by rounding. */
            if (*x < middle) {
                low = *x;
            } else {
                high = *x;
            }
            next = (low + high) / 2;
        } else {
            left = linkage_gap(model, side, &position, p, &gap);
            is_at = linkage_is_at(model, side, p, x, left);
            if (left <= LINKAGE_ENOUGH || (left <= LINKAGE_CLOSE && left > before / 2)) {
                return is_at;
            }
            if ((gap > 0) == (range > 0)) {
                low = *x;
            } else {
                high = *x;
            }
            next = *x + gap / p->rate[side][0][0];
            if (!(next > low && next < high) || left > before / 2) {
                next = (low + high) / 2;
            }
        }
        if (!(next > low && next < high)) {
            return is_at;
        }
    }
    return 0;
}

/* The input nearest to q, searched in all pieces of the reach that have the position. */
static inline int linkage_search(const linkage_model *model, int side, int count,
    const linkage_piece *piece, const linkage_real *position, linkage_real *q, linkage_point *p)
{
    const linkage_goal goal = { { 0 }, { q[0] }, { 0 } };
    linkage_real best = -1;
    int k;
    for (k = 0; k < count && isfinite(position[0]); k++) {
        linkage_point found;
        linkage_real x, brought, away;
        if (!linkage_search_piece(model, side, &piece[k], position[0], goal.near[0], &x, &found)) {
            continue;
        }
        away = linkage_bring(model, side, &goal, &x, &brought);
        if (away >= 0 && (best < 0 || away < best)) {
            best = away;
            *q = brought;
            *p = found;
            linkage_count_turns(model, &x, q, p);
        }
    }
    return best >= 0;
}

/* --- actuators and joints --- */

/* Sample i of the inputs, all over their ranges; 0 is where they start. */
static inline void linkage_sample(const linkage_model *model, long i, linkage_real *q)
{
    int k;
    for (k = 0; k < model->inputs; k++) {
        const linkage_input *input = &model->input[k];
        const linkage_real x = input->step * (linkage_real)i;
        q[k] = i ? input->low + input->width * (x - linkage_floor(x)) : input->start;
    }
}

/* Initialize the memory and find a first pose; returns 0 if there is none. */
static inline int linkage_begin(const linkage_model *model, linkage_memory *m)
{
    int i;
    memset(m, 0, sizeof *m);
    m->newer = LINKAGE_JOINTS;
    for (i = 0; i < model->inputs; i++) {
        m->held[LINKAGE_ACTUATORS].position[i] = LINKAGE_NAN;
        m->held[LINKAGE_JOINTS].position[i] = LINKAGE_NAN;
    }
    for (i = 0; i < LINKAGE_SAMPLES; i++) {
        linkage_sample(model, i, m->q[LINKAGE_JOINTS]);
        if (model->at(m->q[LINKAGE_JOINTS], 1, &m->point[LINKAGE_JOINTS])) {
            return 1;
        }
    }
    return 0;
}

static inline int linkage_are_finite(int n, const linkage_real *x)
{
    int i;
    for (i = 0; i < n; i++) {
        if (!isfinite(x[i])) {
            return 0;
        }
    }
    return 1;
}

/* Find the pose of positions, and keep it as the newest; returns a status. */
static inline int linkage_move(const linkage_model *model, linkage_inverse *inverse,
    linkage_memory *m, int side, const linkage_real *position)
{
    const int other = 1 - side;
    linkage_point p = m->point[m->newer];
    linkage_real q[LINKAGE_MAX_INPUTS], gap[LINKAGE_MAX_INPUTS];
    int i, is_there;
    if (!linkage_are_finite(model->inputs, position)) {
        return LINKAGE_NOT_KNOWN;
    }
    /* Where it is already needs no search; but a command has to be in the sweep. */
    is_there = m->is_known && linkage_gap(model, side, position, &p, gap) <= LINKAGE_ENOUGH;
    for (i = 0; i < model->inputs; i++) {
        const linkage_real *sweep = model->input[i].sweep;
        q[i] = m->q[m->newer][i];
        if (side == LINKAGE_JOINTS && !(q[i] >= sweep[0] && q[i] <= sweep[1])) {
            is_there = 0;
        }
    }
    if (!is_there && !inverse(position, q, &p)) {
        return LINKAGE_OUT_OF_REACH;
    }
    if (!linkage_are_finite(model->inputs, p.position[other])) {
        return LINKAGE_OUT_OF_REACH;
    }
    m->newer = side;
    m->is_known = 1;
    m->point[side] = p;
    for (i = 0; i < model->inputs; i++) {
        m->q[side][i] = q[i];
        m->held[other].position[i] = p.position[other][i];
    }
    return LINKAGE_OK;
}

/* Velocities of the other side at the newest pose, 0 where they are not OK; returns a status, from
   that of the positions: velocities alone are those at the last pose. */
static inline int linkage_velocities(const linkage_model *model, const linkage_memory *m, int side,
    int status, const linkage_real *velocity, linkage_real *other)
{
    const linkage_point *p = &m->point[m->newer];
    linkage_real x[LINKAGE_MAX_INPUTS];
    int i, j;
    if (status == LINKAGE_NOT_KNOWN && m->is_known) {
        status = LINKAGE_OK;
    }
    if (!linkage_are_finite(model->inputs, velocity)) {
        status |= LINKAGE_NOT_KNOWN;
    }
    if (status == LINKAGE_OK
        && !linkage_input_change(model, side, p, LINKAGE_SINGULAR, velocity, x)) {
        status = LINKAGE_SINGULAR_POSE;
    }
    for (i = 0; i < model->inputs; i++) {
        other[i] = 0;
        for (j = 0; j < model->inputs && status == LINKAGE_OK; j++) {
            other[i] += p->rate[1 - side][i][j] * x[j];
        }
        if (!isfinite(other[i])) {
            other[i] = 0;
            status = LINKAGE_SINGULAR_POSE;
        }
    }
    return status;
}

/* Efforts of the other side at a pose; returns a status. The power of the actuators is that of the
   joints less that of the loads. */
static inline int linkage_efforts(const linkage_model *model, const linkage_point *p, int side,
    const linkage_real *effort, linkage_real *other)
{
    linkage_real a[LINKAGE_MAX_INPUTS][LINKAGE_MAX_INPUTS];
    int i, j;
    if (!linkage_are_finite(model->inputs, effort)) {
        return LINKAGE_NOT_KNOWN;
    }
    for (i = 0; i < model->inputs; i++) {
        other[i] = side == LINKAGE_JOINTS ? p->load[i] : -p->load[i];
        for (j = 0; j < model->inputs; j++) {
            other[i] += p->rate[side][j][i] * effort[j];
            a[i][j] = p->rate[1 - side][j][i] * model->axis[1 - side][j].scale;
        }
    }
    if (!linkage_solve(model->inputs, LINKAGE_SINGULAR, a, other)) {
        return LINKAGE_SINGULAR_POSE;
    }
    for (i = 0; i < model->inputs; i++) {
        other[i] *= model->axis[1 - side][i].scale;
    }
    return linkage_are_finite(model->inputs, other) ? LINKAGE_OK : LINKAGE_SINGULAR_POSE;
}

/* Copy the values that are finite. */
static inline void linkage_copy(int n, const linkage_real *from, linkage_real *to)
{
    int i;
    for (i = 0; i < n; i++) {
        if (isfinite(from[i])) {
            to[i] = from[i];
        }
    }
}

/* From the actuators' positions, velocities and efforts to the joints'. Returns a status: where it is
   not OK, positions and efforts are the last measured ones, and velocities 0. */
static inline int linkage_to_joints(const linkage_model *model, linkage_inverse *inverse,
    linkage_memory *m, const linkage_side *from, linkage_side *to)
{
    linkage_side *held = &m->held[LINKAGE_JOINTS];
    linkage_real made[LINKAGE_MAX_INPUTS];
    const int n = model->inputs;
    int position, velocity, effort = LINKAGE_NOT_KNOWN;
    /* Where an actuator is measured is newer than its command, within the reach or not. */
    linkage_copy(n, from->position, m->held[LINKAGE_ACTUATORS].position);

    position = linkage_move(model, inverse, m, LINKAGE_ACTUATORS, from->position);
    linkage_copy(n, held->position, to->position);

    velocity = linkage_velocities(model, m, LINKAGE_ACTUATORS, position, from->velocity, made);
    linkage_copy(n, made, to->velocity);

    if (m->is_known) {
        effort = linkage_efforts(model, &m->point[m->newer], LINKAGE_ACTUATORS, from->effort, made);
    }
    if (effort == LINKAGE_OK) {
        linkage_copy(n, made, held->effort);
    }
    linkage_copy(n, held->effort, to->effort);
    return position | velocity | effort;
}

/* The same from the joints to the actuators, to the inputs nearest to the last ones. Out of reach the
   actuators are commanded to where they are: what was last commanded or measured, whichever is newer.
   What is not commanded, NaN, is not written. */
static inline int linkage_to_actuators(const linkage_model *model, linkage_inverse *inverse,
    linkage_memory *m, const linkage_side *from, linkage_side *to)
{
    const int before = m->newer, was_known = m->is_known;
    linkage_side *held = &m->held[LINKAGE_ACTUATORS];
    linkage_real made[LINKAGE_MAX_INPUTS];
    const int n = model->inputs;
    int i, position, velocity, effort = LINKAGE_NOT_KNOWN;
    /* Efforts act where the actuators are, not where they are commanded to be. */
    const linkage_point here = m->point[before];

    position = linkage_move(model, inverse, m, LINKAGE_JOINTS, from->position);
    if (position != LINKAGE_NOT_KNOWN) {
        linkage_copy(n, held->position, to->position);
    }

    velocity = linkage_velocities(model, m, LINKAGE_JOINTS, position, from->velocity, made);
    if (!(velocity & LINKAGE_NOT_KNOWN)) {
        linkage_copy(n, made, to->velocity);
    }

    if (m->is_known) {
        effort = linkage_efforts(model, was_known ? &here : &m->point[m->newer], LINKAGE_JOINTS,
            from->effort, made);
    }
    for (i = 0; i < n && effort != LINKAGE_SINGULAR_POSE; i++) {
        /* What was commanded before a pause is not held after it. */
        held->effort[i] = effort == LINKAGE_OK ? made[i] : 0;
    }
    if (effort != LINKAGE_NOT_KNOWN) {
        linkage_copy(n, held->effort, to->effort);
    }
    return position | velocity | effort;
}

#endif /* LINKAGE_ROS_LINKAGE_H */
