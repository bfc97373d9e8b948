/*
 * lever: slotted_lever, written by linkage_ros.
 * Lengths [m]: a = 0.02, b = 0.045, e = 0.
 * Input: crank [rad]. Angles [rad] count counterclockwise.
 * It can be assembled in [-3.14159, 3.14159] rad.
 * A call takes at most 15 poses.
 * float: joints are off by up to 1e-07 of the longest bar at 2001 poses over the reach, without its outermost hundredth.
 */
#ifndef LEVER_LINKAGE_H
#define LEVER_LINKAGE_H

#ifndef LKR_MAX_INPUTS
#define LKR_MAX_INPUTS 1
#endif
#ifndef LKR_FLOAT
#define LKR_FLOAT 1
#endif
// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

/*
 * What the headers of all linkages have in common: names that begin with lkr_ or LKR_.
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
#ifndef LKR_MAX_INPUTS
#define LKR_MAX_INPUTS 6
#endif
#ifndef LKR_FLOAT
#define LKR_FLOAT 0
#endif

#if LKR_FLOAT
typedef float lkr_real;
#define lkr_abs fabsf
#define lkr_floor floorf
#define lkr_sqrt sqrtf
#define lkr_atan2 atan2f
/* A Jacobian below this part of its size is singular: for velocities, and for Newton's method. */
#define LKR_SINGULAR 1e-3f
#define LKR_LEAST 1e-5f
/* Newton's method ends at ENOUGH, and may leave CLOSE, times the rate or STEEPEST [rad, sizes]. */
#define LKR_ENOUGH 2e-6f
#define LKR_CLOSE 4e-6f
#define LKR_STEEPEST 1e3f
/* An input may be beyond an end of the reach by SLACK; it is then moved inside by INSIDE. */
#define LKR_SLACK 1e-5f
#define LKR_INSIDE 2e-6f
#else
#if DBL_MANT_DIG < 53
#error "double is a float on this machine: print the header again with --float"
#endif
typedef double lkr_real;
#define lkr_abs fabs
#define lkr_floor floor
#define lkr_sqrt sqrt
#define lkr_atan2 atan2
#define LKR_SINGULAR 1e-6
#define LKR_LEAST 1e-12
#define LKR_ENOUGH 1e-14
#define LKR_CLOSE 1e-13
#define LKR_STEEPEST 4e6
#define LKR_SLACK 1e-9
#define LKR_INSIDE 1e-14
#endif

/* Poses of Newton's method: from a closed form, and of a search in a piece of the reach. */
#define LKR_CLOSED_POSES 4
#define LKR_SEARCH_POSES 64
/* States that are tried for a first pose. */
#define LKR_SAMPLES 4096
#define LKR_NAN ((lkr_real)NAN)
/* A closed form that misses by more than this belongs to another assembly [rad, sizes]. */
#define LKR_OTHER ((lkr_real)0.01)
/* Half, in a form that both kinds of numbers have. */
#define LKR_HALF ((lkr_real)0.5)

/* Formulas are inlined wherever a pose is needed, so that only what is used there is computed. */
#ifdef __GNUC__
#define LKR_FORMULA static inline __attribute__((always_inline))
#define LKR_PURE static __attribute__((const, noinline, unused))
/* Farther than anything: where that is infinite, a compiler leaves out what asks for it. */
#define LKR_FAR ((lkr_real)INFINITY)
#else
#define LKR_FAR ((lkr_real)1e30)
#define LKR_FORMULA static inline
#define LKR_PURE static inline
#endif

/* --- numbers --- */

/* The larger and the smaller one, quicker than fmax and fmin; b is left out if it is NaN. */
static inline lkr_real lkr_max(lkr_real a, lkr_real b)
{
    return b > a ? b : a;
}

static inline lkr_real lkr_min(lkr_real a, lkr_real b)
{
    return b < a ? b : a;
}

/* Whether x is more than half a turn, if there are turns. */
LKR_FORMULA int lkr_is_beyond(lkr_real x, lkr_real turn)
{
    return turn > 0 && lkr_abs(x) > turn / 2;
}

/* The whole turns nearest to x; a compiler divides where it compiles. */
LKR_FORMULA lkr_real lkr_turns(lkr_real x, lkr_real turn)
{
    return turn * lkr_floor(x * (1 / turn) + LKR_HALF);
}

/* x without whole turns, if there are any. */
LKR_FORMULA lkr_real lkr_wrapped(lkr_real x, lkr_real turn)
{
    return lkr_is_beyond(x, turn) ? x - lkr_turns(x, turn) : x;
}

/* A limit that is missed by rounding counts as reached. */
static inline lkr_real lkr_root(lkr_real x, lkr_real tolerance)
{
    if (x > 0) {
        return lkr_sqrt(x);
    }
    return x >= -tolerance ? 0 : LKR_NAN;
}

static inline lkr_real lkr_gated(lkr_real x, lkr_real margin, lkr_real tolerance)
{
    return margin >= -tolerance ? x : LKR_NAN;
}

/* The angle of (x, y); a compiler leaves it out where it is not used. */
LKR_PURE lkr_real lkr_angle(lkr_real y, lkr_real x)
{
    return lkr_atan2(y, x);
}

/* --- types --- */

enum { LKR_ACTUATORS = 0, LKR_JOINTS = 1 };

/* Status of a call: 0, or a sum of these. OUT_OF_REACH: outside the reach or the sweep. SINGULAR: a
   velocity or an effort would be infinite. NOT_KNOWN: a value is NaN or infinite, which of a command
   means that there is none. */
enum { LKR_OK = 0, LKR_OUT_OF_REACH = 1, LKR_SINGULAR_POSE = 2, LKR_NOT_KNOWN = 4 };

/* Positions, velocities and efforts of the actuators, or of the joints. */
typedef struct {
    lkr_real position[LKR_MAX_INPUTS];
    lkr_real velocity[LKR_MAX_INPUTS];
    lkr_real effort[LKR_MAX_INPUTS];
} lkr_side;

/* A pose: positions of the actuators [0] and joints [1], their rates by each input, and the inputs'
   efforts against the loads. */
typedef struct {
    lkr_real position[2][LKR_MAX_INPUTS];
    lkr_real rate[2][LKR_MAX_INPUTS][LKR_MAX_INPUTS];
    lkr_real load[LKR_MAX_INPUTS];
} lkr_point;

/* The place of an actuator or a joint in a linkage. */
typedef struct {
    const char *name;
    /* One over the size of its position, and what it may change by without effect, or 0. */
    lkr_real scale, turn;
    /* If it counts the turns of an input: the input, the rate by it, and the position where that is 0.
       Otherwise the rate is 0. */
    int input;
    lkr_real rate, zero;
} lkr_axis;

/* An input, in rad or in its size: after how much poses repeat, or 0; its start, the range of its
   samples, their step, and its sweep. */
typedef struct {
    lkr_real turn, start, low, width, step;
    lkr_real sweep[2];
} lkr_input;

/* A linkage. Inputs q are in rad or in sizes. */
typedef struct {
    int inputs;
    /* Whether the pose of an inverse is to have rates and loads. */
    int is_rated;
    /* The pose at inputs, with rates and loads or without; 0 if it cannot be assembled. */
    int (*at)(const lkr_real *q, int is_rated, lkr_point *p);
    lkr_axis axis[2][LKR_MAX_INPUTS];
    lkr_input input[LKR_MAX_INPUTS];
    /* After how much of each input the actuators or the joints repeat, or 0. */
    lkr_real turn[2][LKR_MAX_INPUTS];
    /* The reach of its only input, if it has ends: middles of arcs and half their lengths. */
    int arcs;
    const lkr_real (*arc)[2];
} lkr_model;

/* From positions of actuators or joints to the inputs nearest to q, and the pose there. */
typedef int lkr_inverse(const lkr_real *position, lkr_real *q, lkr_point *p);

/* What an inverse looks for: positions and near inputs without the whole turns that are counted. */
typedef struct {
    lkr_real to[LKR_MAX_INPUTS];
    lkr_real near[LKR_MAX_INPUTS];
    lkr_real whole[LKR_MAX_INPUTS];
} lkr_goal;

/* Inputs from which a goal may be reached, and how far they are from the near ones, or -1. */
typedef struct {
    lkr_real q[LKR_MAX_INPUTS];
    lkr_real away;
} lkr_start;

/* A part of the reach in which a position only rises, or only falls: both ends. */
typedef struct {
    lkr_real q[2];
    lkr_real position[2];
} lkr_piece;

/* The state between calls: the last poses and inputs by measured actuators [0] and by commanded
   joints [1], which of them is newer, and whether there is one; what is held: the actuators [0] where
   they were last commanded or measured, whichever is newer, and the joints [1] where they were last
   measured. NaN was never there. */
typedef struct {
    lkr_point point[2];
    lkr_real q[2][LKR_MAX_INPUTS];
    int newer, is_known;
    lkr_side held[2];
} lkr_memory;

/* --- a pose and positions --- */

/* Gaps from a pose to positions, the shorter way round; returns the largest, in sizes. */
static inline lkr_real lkr_gap(const lkr_model *model, int side, const lkr_real *to,
    const lkr_point *p, lkr_real *gap)
{
    lkr_real most = 0;
    int i;
    for (i = 0; i < model->inputs; i++) {
        const lkr_axis *axis = &model->axis[side][i];
        gap[i] = lkr_wrapped(to[i] - p->position[side][i], axis->turn);
        most = lkr_max(most, lkr_abs(gap[i]) * axis->scale);
    }
    return most;
}

/* Solve a x = b in place, b in x; returns the determinant's sign, 0 where a is singular. */
static inline int lkr_solve(int size, lkr_real least,
    lkr_real a[LKR_MAX_INPUTS][LKR_MAX_INPUTS], lkr_real *x)
{
    /* A compiler knows this bound. */
    const int n = size < LKR_MAX_INPUTS ? size : LKR_MAX_INPUTS;
    lkr_real most = 1;
    int i, j, k, sign = 1;
    for (i = 0; i < n; i++) {
        for (j = 0; j < n; j++) {
            if (!isfinite(a[i][j])) {
                return 0;
            }
            most = lkr_max(most, lkr_abs(a[i][j]));
        }
    }
    for (k = 0; k < n; k++) {
        lkr_real pivot;
        int best = k;
        for (i = k + 1; i < n; i++) {
            best = lkr_abs(a[i][k]) > lkr_abs(a[best][k]) ? i : best;
        }
        if (!(lkr_abs(a[best][k]) > least * most)) {
            return 0;
        }
        for (j = k; j < n; j++) {
            const lkr_real swapped = a[k][j];
            a[k][j] = a[best][j];
            a[best][j] = swapped;
        }
        pivot = x[best];
        x[best] = x[k];
        x[k] = pivot;
        sign = (best == k) == (a[k][k] > 0) ? sign : -sign;
        for (i = k + 1; i < n; i++) {
            const lkr_real factor = a[i][k] / a[k][k];
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

/* The change of the inputs for a change of positions; returns as lkr_solve. */
static inline int lkr_input_change(const lkr_model *model, int side, const lkr_point *p,
    lkr_real least, const lkr_real *change, lkr_real *x)
{
    lkr_real a[LKR_MAX_INPUTS][LKR_MAX_INPUTS];
    int i, j;
    for (i = 0; i < model->inputs; i++) {
        const lkr_real scale = model->axis[side][i].scale;
        for (j = 0; j < model->inputs; j++) {
            a[i][j] = p->rate[side][i][j] * scale;
        }
        x[i] = change[i] * scale;
    }
    return lkr_solve(model->inputs, least, a, x);
}

/* Whether a pose at inputs q misses positions by rounding only: of the inputs, where it moves fast. */
static inline int lkr_is_at(const lkr_model *model, int side, const lkr_point *p,
    const lkr_real *q, lkr_real left)
{
    lkr_real steepest = 1;
    int i, j;
    for (i = 0; i < model->inputs; i++) {
        for (j = 0; j < model->inputs; j++) {
            const lkr_real rate = lkr_abs(p->rate[side][i][j]) * model->axis[side][i].scale;
            steepest = lkr_max(steepest, rate * lkr_max(1, lkr_abs(q[j])));
        }
    }
    /* At an end of the reach the rate is infinite, yet rounding is not. */
    return left <= LKR_CLOSE * lkr_min(steepest, LKR_STEEPEST);
}

/* --- the inverse --- */

/* What to look for; returns 0 if a position is not finite. */
static inline int lkr_aim(const lkr_model *model, int side, const lkr_real *position,
    const lkr_real *q, lkr_goal *goal)
{
    int i;
    for (i = 0; i < model->inputs; i++) {
        goal->near[i] = q[i];
        goal->whole[i] = 0;
    }
    for (i = 0; i < model->inputs; i++) {
        const lkr_axis *axis = &model->axis[side][i];
        if (!isfinite(position[i])) {
            return 0;
        }
        goal->to[i] = position[i];
        if (axis->rate != 0) {
            /* It determines the input; whole turns are subtracted, so that they cost no digits. */
            const int k = axis->input;
            const lkr_real turn = model->input[k].turn;
            goal->near[k] = (position[i] - axis->zero) / axis->rate;
            if (lkr_is_beyond(goal->near[k], turn)) {
                goal->whole[k] = lkr_turns(goal->near[k], turn);
                goal->to[i] -= axis->rate * goal->whole[k];
            }
        }
    }
    return 1;
}

/* Whether an input is in its reach, or beyond an end by rounding. */
static inline int lkr_is_within(const lkr_model *model, lkr_real q, lkr_real *inside)
{
    int i;
    for (i = 0; i < model->arcs; i++) {
        const lkr_real gap = lkr_wrapped(q - model->arc[i][0], model->input[0].turn);
        const lkr_real over = lkr_abs(gap) - model->arc[i][1];
        if (over <= LKR_SLACK) {
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
static inline lkr_real lkr_bring(const lkr_model *model, int side,
    const lkr_goal *goal, const lkr_real *x, lkr_real *q)
{
    lkr_real away = 0;
    int i;
    for (i = 0; i < model->inputs; i++) {
        const lkr_real low = model->input[i].sweep[0];
        const lkr_real high = model->input[i].sweep[1];
        const lkr_real turn = model->turn[side][i];
        lkr_real near = goal->near[i];
        if (side == LKR_JOINTS) {
            near = lkr_min(lkr_max(near, low), high);
        }
        q[i] = x[i] + goal->whole[i];
        if (lkr_is_beyond(near - q[i], turn)) {
            q[i] += lkr_turns(near - q[i], turn);
        }
        if (side == LKR_JOINTS && q[i] < low) {
            q[i] += turn;
        } else if (side == LKR_JOINTS && q[i] > high) {
            q[i] -= turn;
        }
        if (q[i] < low || q[i] > high) {
            if (side == LKR_JOINTS) {
                return -1;
            }
            away += 10 * lkr_max(low - q[i], q[i] - high);
        }
        away += lkr_abs(q[i] - goal->near[i]);
    }
    return isfinite(away) ? away : -1;
}

/* Give the positions of a pose at x the whole turns of q. */
static inline void lkr_count_turns(const lkr_model *model, const lkr_real *x,
    const lkr_real *q, lkr_point *p)
{
    int side, i;
    for (side = LKR_ACTUATORS; side <= LKR_JOINTS; side++) {
        for (i = 0; i < model->inputs; i++) {
            const lkr_axis *axis = &model->axis[side][i];
            if (axis->rate != 0) {
                p->position[side][i] += axis->rate * (q[axis->input] - x[axis->input]);
            }
        }
    }
}

/* Newton's method from a rated pose at inputs q that misses positions by gaps, of which `left` is the
   largest: each step comes nearer, and stays on its side of singular poses. Returns 0, with any q, if
   it does not get there. */
static inline int lkr_refine(const lkr_model *model, int side, const lkr_real *to,
    lkr_real left, lkr_real *gap, lkr_real *q, lkr_point *p)
{
    lkr_point next;
    lkr_real moved[LKR_MAX_INPUTS];
    lkr_real x[LKR_MAX_INPUTS], y[LKR_MAX_INPUTS];
    lkr_real share = 1;
    int sign = lkr_input_change(model, side, p, LKR_LEAST, gap, x);
    int i, step;
    for (step = 1; step < LKR_CLOSED_POSES && sign != 0 && left > LKR_ENOUGH; step++) {
        lkr_real now = left;
        lkr_real longest = LKR_HALF;
        int other = 0;
        for (i = 0; i < model->inputs; i++) {
            longest = lkr_max(longest, lkr_abs(x[i]));
        }
        for (i = 0; i < model->inputs; i++) {
            moved[i] = q[i] + share * LKR_HALF / longest * x[i];
        }
        if (model->at(moved, 1, &next)) {
            now = lkr_gap(model, side, to, &next, gap);
        }
        if (now < left) {
            other = lkr_input_change(model, side, &next, LKR_LEAST, gap, y);
        }
        if (now < left && (other == sign || now <= LKR_CLOSE)) {
            *p = next;
            left = now;
            sign = other;
            share = 1;
            for (i = 0; i < model->inputs; i++) {
                q[i] = moved[i];
                x[i] = y[i];
            }
        } else if (left <= LKR_CLOSE) {
            break;
        } else {
            share /= 2;
        }
    }
    return lkr_is_at(model, side, p, q, left);
}

/* From a start to positions; returns 0 if they are not reached in this assembly. */
static inline int lkr_reach(const lkr_model *model, int side, const lkr_goal *goal,
    lkr_real most, lkr_real *x, lkr_point *p)
{
    lkr_real gap[LKR_MAX_INPUTS];
    lkr_real left;
    /* A start may be beyond an end of the reach by rounding. */
    if (!model->at(x, model->is_rated, p)
        && !(model->arcs > 0 && lkr_is_within(model, x[0], &x[0]) && model->at(x, model->is_rated, p))) {
        return 0;
    }
    left = lkr_gap(model, side, goal->to, p, gap);
    if (left <= LKR_ENOUGH) {
        return 1;
    }
    return left <= most && (model->is_rated || model->at(x, 1, p))
        && lkr_refine(model, side, goal->to, left, gap, x, p);
}

/* The inputs nearest to those of the goal, of `count` starts; what an axis counts is known. If none
   leads there, by Newton's method from the near ones, for which there is one more start. */
static inline int lkr_choose(const lkr_model *model, int side, const lkr_goal *goal,
    int count, lkr_start *start, lkr_real *q, lkr_point *p)
{
    lkr_real inside;
    int i, k;
    for (k = 0; k < count; k++) {
        for (i = 0; i < model->inputs; i++) {
            const lkr_axis *axis = &model->axis[side][i];
            if (axis->rate != 0) {
                start[k].q[axis->input] = goal->near[axis->input] - goal->whole[axis->input];
            }
        }
        start[k].away = lkr_bring(model, side, goal, start[k].q, q);
        if (model->arcs > 0 && !lkr_is_within(model, start[k].q[0], &inside)) {
            start[k].away = -1;
        }
    }
    for (i = 0; i < model->inputs; i++) {
        start[count].q[i] = lkr_wrapped(goal->near[i] - goal->whole[i], model->input[i].turn);
    }
    start[count].away = LKR_FAR;
    for (;;) {
        lkr_start *nearest = 0;
        lkr_real most;
        for (k = 0; k <= count; k++) {
            if (start[k].away >= 0 && (!nearest || start[k].away < nearest->away)) {
                nearest = &start[k];
            }
        }
        if (!nearest) {
            return 0;
        }
        most = nearest == &start[count] ? LKR_FAR : LKR_OTHER;
        nearest->away = -1;
        if (lkr_reach(model, side, goal, most, nearest->q, p)
            && lkr_bring(model, side, goal, nearest->q, q) >= 0) {
            lkr_count_turns(model, nearest->q, q, p);
            return 1;
        }
    }
}

/* Search a position in a piece of the reach, by Newton's method between brackets. */
static inline int lkr_search_piece(const lkr_model *model, int side,
    const lkr_piece *piece, lkr_real position, lkr_real near, lkr_real *x,
    lkr_point *p)
{
    const lkr_real range = piece->position[1] - piece->position[0];
    const lkr_real middle = (piece->q[0] + piece->q[1]) / 2;
    const lkr_real scale = model->axis[side][0].scale;
    lkr_real low = piece->q[0];
    lkr_real high = piece->q[1];
    lkr_real left = LKR_FAR;
    lkr_real gap, inside, next;
    int step;
    p->position[side][0] = (piece->position[0] + piece->position[1]) / 2;
    (void)lkr_gap(model, side, &position, p, &gap);
    inside = (lkr_abs(range) / 2 - lkr_abs(gap)) * scale;
    if (!(inside >= -LKR_CLOSE)) {
        return 0;
    }
    next = low + (high - low) * (LKR_HALF + gap / range);
    near = middle + lkr_wrapped(near - middle, model->turn[side][0]);
    if (inside <= LKR_CLOSE) {
        next = next > middle ? high : low;
    } else if (near > low && near < high) {
        next = near;
    }
    for (step = 0; step < LKR_SEARCH_POSES; step++) {
        const lkr_real before = left;
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
            left = lkr_gap(model, side, &position, p, &gap);
            is_at = lkr_is_at(model, side, p, x, left);
            if (left <= LKR_ENOUGH || (left <= LKR_CLOSE && left > before / 2)) {
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
static inline int lkr_search(const lkr_model *model, int side, int count,
    const lkr_piece *piece, const lkr_real *position, lkr_real *q, lkr_point *p)
{
    const lkr_goal goal = { { 0 }, { q[0] }, { 0 } };
    lkr_real best = -1;
    int k;
    for (k = 0; k < count && isfinite(position[0]); k++) {
        lkr_point found;
        lkr_real x, brought, away;
        if (!lkr_search_piece(model, side, &piece[k], position[0], goal.near[0], &x, &found)) {
            continue;
        }
        away = lkr_bring(model, side, &goal, &x, &brought);
        if (away >= 0 && (best < 0 || away < best)) {
            best = away;
            *q = brought;
            *p = found;
            lkr_count_turns(model, &x, q, p);
        }
    }
    return best >= 0;
}

/* --- actuators and joints --- */

/* Sample i of the inputs, all over their ranges; 0 is where they start. */
static inline void lkr_sample(const lkr_model *model, long i, lkr_real *q)
{
    int k;
    for (k = 0; k < model->inputs; k++) {
        const lkr_input *input = &model->input[k];
        const lkr_real x = input->step * (lkr_real)i;
        q[k] = i ? input->low + input->width * (x - lkr_floor(x)) : input->start;
    }
}

/* Initialize the memory and find a first pose; returns 0 if there is none. */
static inline int lkr_begin(const lkr_model *model, lkr_memory *m)
{
    int i;
    memset(m, 0, sizeof *m);
    m->newer = LKR_JOINTS;
    for (i = 0; i < model->inputs; i++) {
        m->held[LKR_ACTUATORS].position[i] = LKR_NAN;
        m->held[LKR_JOINTS].position[i] = LKR_NAN;
    }
    for (i = 0; i < LKR_SAMPLES; i++) {
        lkr_sample(model, i, m->q[LKR_JOINTS]);
        if (model->at(m->q[LKR_JOINTS], 1, &m->point[LKR_JOINTS])) {
            return 1;
        }
    }
    return 0;
}

static inline int lkr_are_finite(int n, const lkr_real *x)
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
static inline int lkr_move(const lkr_model *model, lkr_inverse *inverse,
    lkr_memory *m, int side, const lkr_real *position)
{
    const int other = 1 - side;
    lkr_point p = m->point[m->newer];
    lkr_real q[LKR_MAX_INPUTS], gap[LKR_MAX_INPUTS];
    int i, is_there;
    if (!lkr_are_finite(model->inputs, position)) {
        return LKR_NOT_KNOWN;
    }
    /* Where it is already needs no search; but a command has to be in the sweep. */
    is_there = m->is_known && lkr_gap(model, side, position, &p, gap) <= LKR_ENOUGH;
    for (i = 0; i < model->inputs; i++) {
        const lkr_real *sweep = model->input[i].sweep;
        q[i] = m->q[m->newer][i];
        if (side == LKR_JOINTS && !(q[i] >= sweep[0] && q[i] <= sweep[1])) {
            is_there = 0;
        }
    }
    if (!is_there && !inverse(position, q, &p)) {
        return LKR_OUT_OF_REACH;
    }
    if (!lkr_are_finite(model->inputs, p.position[other])) {
        return LKR_OUT_OF_REACH;
    }
    m->newer = side;
    m->is_known = 1;
    m->point[side] = p;
    for (i = 0; i < model->inputs; i++) {
        m->q[side][i] = q[i];
        m->held[other].position[i] = p.position[other][i];
    }
    return LKR_OK;
}

/* Velocities of the other side at the newest pose, 0 where they are not OK; returns a status, from
   that of the positions: velocities alone are those at the last pose. */
static inline int lkr_velocities(const lkr_model *model, const lkr_memory *m, int side,
    int status, const lkr_real *velocity, lkr_real *other)
{
    const lkr_point *p = &m->point[m->newer];
    lkr_real x[LKR_MAX_INPUTS];
    int i, j;
    if (status == LKR_NOT_KNOWN && m->is_known) {
        status = LKR_OK;
    }
    if (!lkr_are_finite(model->inputs, velocity)) {
        status |= LKR_NOT_KNOWN;
    }
    if (status == LKR_OK
        && !lkr_input_change(model, side, p, LKR_SINGULAR, velocity, x)) {
        status = LKR_SINGULAR_POSE;
    }
    for (i = 0; i < model->inputs; i++) {
        other[i] = 0;
        for (j = 0; j < model->inputs && status == LKR_OK; j++) {
            other[i] += p->rate[1 - side][i][j] * x[j];
        }
        if (!isfinite(other[i])) {
            other[i] = 0;
            status = LKR_SINGULAR_POSE;
        }
    }
    return status;
}

/* Efforts of the other side at a pose; returns a status. The power of the actuators is that of the
   joints less that of the loads. */
static inline int lkr_efforts(const lkr_model *model, const lkr_point *p, int side,
    const lkr_real *effort, lkr_real *other)
{
    lkr_real a[LKR_MAX_INPUTS][LKR_MAX_INPUTS];
    int i, j;
    if (!lkr_are_finite(model->inputs, effort)) {
        return LKR_NOT_KNOWN;
    }
    for (i = 0; i < model->inputs; i++) {
        other[i] = side == LKR_JOINTS ? p->load[i] : -p->load[i];
        for (j = 0; j < model->inputs; j++) {
            other[i] += p->rate[side][j][i] * effort[j];
            a[i][j] = p->rate[1 - side][j][i] * model->axis[1 - side][j].scale;
        }
    }
    if (!lkr_solve(model->inputs, LKR_SINGULAR, a, other)) {
        return LKR_SINGULAR_POSE;
    }
    for (i = 0; i < model->inputs; i++) {
        other[i] *= model->axis[1 - side][i].scale;
    }
    return lkr_are_finite(model->inputs, other) ? LKR_OK : LKR_SINGULAR_POSE;
}

/* Copy the values that are finite. */
static inline void lkr_copy(int n, const lkr_real *from, lkr_real *to)
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
static inline int lkr_to_joints(const lkr_model *model, lkr_inverse *inverse,
    lkr_memory *m, const lkr_side *from, lkr_side *to)
{
    lkr_side *held = &m->held[LKR_JOINTS];
    lkr_real made[LKR_MAX_INPUTS];
    const int n = model->inputs;
    int position, velocity, effort = LKR_NOT_KNOWN;
    /* Where an actuator is measured is newer than its command, within the reach or not. */
    lkr_copy(n, from->position, m->held[LKR_ACTUATORS].position);

    position = lkr_move(model, inverse, m, LKR_ACTUATORS, from->position);
    lkr_copy(n, held->position, to->position);

    velocity = lkr_velocities(model, m, LKR_ACTUATORS, position, from->velocity, made);
    lkr_copy(n, made, to->velocity);

    if (m->is_known) {
        effort = lkr_efforts(model, &m->point[m->newer], LKR_ACTUATORS, from->effort, made);
    }
    if (effort == LKR_OK) {
        lkr_copy(n, made, held->effort);
    }
    lkr_copy(n, held->effort, to->effort);
    return position | velocity | effort;
}

/* The same from the joints to the actuators, to the inputs nearest to the last ones. Out of reach the
   actuators are commanded to where they are: what was last commanded or measured, whichever is newer.
   What is not commanded, NaN, is not written. */
static inline int lkr_to_actuators(const lkr_model *model, lkr_inverse *inverse,
    lkr_memory *m, const lkr_side *from, lkr_side *to)
{
    const int before = m->newer, was_known = m->is_known;
    lkr_side *held = &m->held[LKR_ACTUATORS];
    lkr_real made[LKR_MAX_INPUTS];
    const int n = model->inputs;
    int i, position, velocity, effort = LKR_NOT_KNOWN;
    /* Efforts act where the actuators are, not where they are commanded to be. */
    const lkr_point here = m->point[before];

    position = lkr_move(model, inverse, m, LKR_JOINTS, from->position);
    if (position != LKR_NOT_KNOWN) {
        lkr_copy(n, held->position, to->position);
    }

    velocity = lkr_velocities(model, m, LKR_JOINTS, position, from->velocity, made);
    if (!(velocity & LKR_NOT_KNOWN)) {
        lkr_copy(n, made, to->velocity);
    }

    if (m->is_known) {
        effort = lkr_efforts(model, was_known ? &here : &m->point[m->newer], LKR_JOINTS,
            from->effort, made);
    }
    for (i = 0; i < n && effort != LKR_SINGULAR_POSE; i++) {
        /* What was commanded before a pause is not held after it. */
        held->effort[i] = effort == LKR_OK ? made[i] : 0;
    }
    if (effort != LKR_NOT_KNOWN) {
        lkr_copy(n, held->effort, to->effort);
    }
    return position | velocity | effort;
}

#endif /* LINKAGE_ROS_LINKAGE_H */
#if LKR_FLOAT != 1 || LKR_MAX_INPUTS < 1
#error "lever computes in float and has 1 inputs: define LKR_FLOAT as 1 and LKR_MAX_INPUTS as 1 or more"
#endif

/* Where the joints are, and each link to its parent. */
typedef struct {
    float O_x, O_y;               /* [m] */
    float Q_x, Q_y;               /* [m] */
    float A_x, A_y;               /* [m] */
    float L_x, L_y;               /* [m] */
    float angle_crank;            /* to ground [rad] */
    float angle_lever;            /* to ground [rad] */
    float slide_slide;            /* [m] */
} lever_pose;

/* The pose, and its rates by crank. Returns 0 if a limit is exceeded. */
LKR_FORMULA int lever_formulas(float crank, lever_pose *p, lever_pose *by_crank)
{
    const float length_a = 0.02f;
    const float k2 = -0.045f; /* -b */
    const float k22 = 0.04f; /* 2 * a */
    const float k26 = 0.025f; /* b - a */
    const float k27 = 0.000625f; /* (b - a) * (b - a) */
    const float k30 = 0.0036f; /* (4 * b) * a */
    const float k36 = 1.0f;
    const float k54 = 0.081f; /* 1.8 * b */
    const float k73 = 0.000625f;
    const float k80 = 0.0f; /* (8.88178e-16 * abs(e)) * ((abs(e) + b) + a) */
    const float k82 = -0.025f; /* a - b */
    const float k83 = 0.09f; /* 2 * b */
    const float x0 = crank;
    /* O ground 0 0 */
    p->O_x = 0.0f;
    p->O_y = 0.0f;
    by_crank->O_x = 0.0f;
    by_crank->O_y = 0.0f;
    /* Q ground 0 -b */
    p->Q_x = 0.0f;
    p->Q_y = k2;
    by_crank->Q_x = 0.0f;
    by_crank->Q_y = 0.0f;
    /* A crank O a up */
    const float v6 = 0.5f * x0;
    const float v7 = sinf(v6);
    const float v9 = cosf(v6);
    const float v13 = -(((2.0f * v7) * v9) * length_a);
    const float v18 = (1.0f - (2.0f * (v7 * v7))) * length_a;
    p->A_x = v13;
    p->A_y = v18;
    p->angle_crank = x0;
    by_crank->A_x = (-v18);
    by_crank->A_y = v13;
    by_crank->angle_crank = lkr_gated(1.0f, fabsf(x0), 0.0f);
    /* L slot Q A e out max(1.8*b,a+b) */
    const float v31 = v9 * v9;
    const float v32 = k30 * v31;
    const float v33 = k27 + v32;
    const float v40 = lkr_gated(v33, ((v31 + k36) - 7.888609e-31f), 0.0f);
    const float v41 = lkr_gated((-((k22 * v7) * v9)), v40, 0.0f);
    const float v45 = lkr_gated((k26 + (k22 * v31)), v40, 0.0f);
    const float v48 = sqrtf(((v41 * v41) + (v45 * v45)));
    const float v49 = v41 / v48;
    const float v56 = v45 / v48;
    const float v81 = lkr_root((k73 + v32), k80);
    const float v88 = ((length_a * (k82 + (k83 * v31))) / v33) + 0.0f;
    p->L_x = (v49 * k54);
    p->L_y = (k2 + (v56 * k54));
    p->angle_lever = lkr_angle((-v49), v56);
    p->slide_slide = v81;
    by_crank->L_x = (-((v88 * v56) * k54));
    by_crank->L_y = ((v88 * v49) * k54);
    by_crank->angle_lever = v88;
    by_crank->slide_slide = ((-((((v7 * 0.5f) * v9) * 2.0f) * k30)) / (2.0f * v81));
    return 1;
}

/* Place the joints. Return 0 if not all can be assembled: NaN is what cannot. */
static inline int lever_solve(float crank, lever_pose *p)
{
    lever_pose by_crank;
    (void)lever_formulas(crank, p, &by_crank);
    return isfinite(p->O_x + p->O_y + p->Q_x + p->Q_y + p->A_x + p->A_y + p->L_x + p->L_y
        + p->angle_crank + p->angle_lever + p->slide_slide);
}

/* Differentiate all of it by crank. */
static inline void lever_rates(float crank, lever_pose *by_crank)
{
    lever_pose p;
    (void)lever_formulas(crank, &p, by_crank);
}

enum {
    LEVER_OK = LKR_OK,
    LEVER_OUT_OF_REACH = LKR_OUT_OF_REACH,
    LEVER_SINGULAR = LKR_SINGULAR_POSE,
    LEVER_NOT_KNOWN = LKR_NOT_KNOWN
};
enum { LEVER_ACTUATOR_LEVER_CRANK = 0 };
enum { LEVER_JOINT_LEVER_LEVER = 0 };
/* Actuators: lever_crank [rad]; joints: lever_lever [rad]. */
typedef lkr_side lever_actuators;
typedef lkr_side lever_joints;
typedef lkr_memory lever_memory;

/* Positions and rates at inputs, each in rad or in its size; 0 if it cannot be assembled. */
static inline int lever_at(const float *q, int is_rated, lkr_point *p)
{
    lever_pose s, by_crank;
    if (!lever_formulas(q[0], &s, &by_crank)) {
        return 0;
    }
    p->position[0][0] = s.angle_crank;
    p->position[1][0] = s.angle_lever;
    if (is_rated) {
        p->rate[0][0][0] = by_crank.angle_crank;
        p->rate[1][0][0] = by_crank.angle_lever;
        p->load[0] = 0.0f;
    }
    return isfinite(p->position[0][0] + p->position[1][0]);
}

/* Tables of the actuators and joints, see lkr_model. */
static const lkr_model lever_model = {
    1, 1, lever_at,
    { { { "lever_crank", 1.0f, 0.0f, 0, 1.0f, 0.0f } },
      { { "lever_lever", 1.0f, 6.2831855f, 0, 0.0f, 0.0f } } },
    { { 6.2831855f, 0.0f, -3.1415927f, 6.2831855f, 0.41421357f, { -LKR_FAR, LKR_FAR } } },
    { { 0.0f }, { 6.2831855f } },
    0, 0
};

/* From positions to the inputs nearest to q. By their gears, 8 poses at most. */
static inline int lever_from_actuators(const float *position, float *q, lkr_point *p)
{
    lkr_goal goal;
    lkr_start start[2];
    if (!lkr_aim(&lever_model, 0, position, q, &goal)) {
        return 0;
    }
    return lkr_choose(&lever_model, 0, &goal, 1, start, q, p);
}

/* The inputs in each assembly mode of the inverse linkage, NAN where there is none:
     O ground 0.0 0.0
     Q ground 0.0 -0.045
     X crank Q 0.081 up
     A slider O 0.02 Q along X out
*/
static inline void lever_modes_joints(const float *position, lkr_start *start)
{
    const float x0 = position[0];
    /* A left */
    const float v3 = 0.5f * x0;
    const float v4 = sinf(v3);
    const float v9 = ((2.0f * v4) * cosf(v3)) * 0.081f;
    const float v15 = (1.0f - (2.0f * (v4 * v4))) * 0.081f;
    const float v18 = sqrtf(((v9 * v9) + (v15 * v15)));
    const float v19 = v9 / v18;
    const float v22 = v19 * 0.045f;
    const float v27 = lkr_root(((0.02f + v22) * (0.02f - v22)), 1.154632e-18f);
    const float v28 = v19 * v27;
    const float v30 = v15 / v18;
    const float v31 = v30 * v22;
    const float v35 = -(v19 * v22);
    const float v36 = v30 * v27;
    start[0].q[0] = lkr_angle((-((-v28) - v31)), (v35 + v36));
    /* A right */
    start[1].q[0] = lkr_angle((-(v28 - v31)), (v35 - v36));
}

/* From positions to the inputs nearest to q. In closed form, 12 poses at most. */
static inline int lever_from_joints(const float *position, float *q, lkr_point *p)
{
    lkr_goal goal;
    lkr_start start[3];
    if (!lkr_aim(&lever_model, 1, position, q, &goal)) {
        return 0;
    }
    lever_modes_joints(goal.to, start);
    return lkr_choose(&lever_model, 1, &goal, 2, start, q, p);
}

/* Initialize the memory and find a first pose; returns 0 if there is none. */
static inline int lever_begin(lever_memory *m)
{
    return lkr_begin(&lever_model, m);
}

/* From actuators to joints, see lkr_to_joints; returns a status. */
static inline int lever_actuators_to_joints(lever_memory *m, const lever_actuators *from,
    lever_joints *to)
{
    return lkr_to_joints(&lever_model, lever_from_actuators, m, from, to);
}

/* From joints to actuators, see lkr_to_actuators; returns a status. */
static inline int lever_joints_to_actuators(lever_memory *m, const lever_joints *from,
    lever_actuators *to)
{
    return lkr_to_actuators(&lever_model, lever_from_joints, m, from, to);
}

/* Positions and rates at inputs, each in rad or in its size; 0 if it cannot be assembled. */
static inline int lever_at_angle_lever(const float *q, int is_rated, lkr_point *p)
{
    lever_pose s, by_crank;
    if (!lever_formulas(q[0], &s, &by_crank)) {
        return 0;
    }
    p->position[1][0] = s.angle_lever;
    if (is_rated) {
        p->rate[1][0][0] = by_crank.angle_lever;
        p->load[0] = 0.0f;
    }
    return isfinite(p->position[1][0]);
}

/* Tables of the inverse, see lkr_model. */
static const lkr_model lever_model_angle_lever = {
    1, 0, lever_at_angle_lever,
    { { { 0, 0.0f, 0.0f, 0, 0.0f, 0.0f } },
      { { "lever", 1.0f, 6.2831855f, 0, 0.0f, 0.0f } } },
    { { 6.2831855f, 0.0f, -3.1415927f, 6.2831855f, 0.41421357f, { -LKR_FAR, LKR_FAR } } },
    { { 6.2831855f }, { 6.2831855f } },
    0, 0
};

/* The inputs in each assembly mode of the inverse linkage, NAN where there is none:
     O ground 0.0 0.0
     Q ground 0.0 -0.045
     X crank Q 0.081 up
     A slider O 0.02 Q along X out
*/
static inline void lever_modes_angle_lever(const float *position, lkr_start *start)
{
    const float x0 = position[0];
    /* A left */
    const float v3 = 0.5f * x0;
    const float v4 = sinf(v3);
    const float v9 = ((2.0f * v4) * cosf(v3)) * 0.081f;
    const float v15 = (1.0f - (2.0f * (v4 * v4))) * 0.081f;
    const float v18 = sqrtf(((v9 * v9) + (v15 * v15)));
    const float v19 = v9 / v18;
    const float v22 = v19 * 0.045f;
    const float v27 = lkr_root(((0.02f + v22) * (0.02f - v22)), 1.154632e-18f);
    const float v28 = v19 * v27;
    const float v30 = v15 / v18;
    const float v31 = v30 * v22;
    const float v35 = -(v19 * v22);
    const float v36 = v30 * v27;
    start[0].q[0] = lkr_angle((-((-v28) - v31)), (v35 + v36));
    /* A right */
    start[1].q[0] = lkr_angle((-(v28 - v31)), (v35 - v36));
}

/* From positions to the inputs nearest to q. In closed form, 15 poses at most. */
static inline int lever_from_angle_lever(const float *position, float *q, lkr_point *p)
{
    lkr_goal goal;
    lkr_start start[3];
    if (!lkr_aim(&lever_model_angle_lever, 1, position, q, &goal)) {
        return 0;
    }
    lever_modes_angle_lever(goal.to, start);
    return lkr_choose(&lever_model_angle_lever, 1, &goal, 2, start, q, p);
}

/* The crank for lever [rad], nearest to `near`, whole turns included. Returns 0, and
   leaves crank alone, where there is none. */
static inline int lever_crank_for_angle_lever(float value, float near, float *crank)
{
    float q[1];
    lkr_point p;
    q[0] = near;
    if (!lever_from_angle_lever(&value, q, &p)) {
        return 0;
    }
    *crank = q[0];
    return 1;
}

#endif /* LEVER_LINKAGE_H */

