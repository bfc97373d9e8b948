/*
 * lever: slotted_lever, written by linkage_ros.
 * Lengths [m]: a = 0.02, b = 0.045, e = 0.
 * Input: crank [rad]. Angles [rad] count counterclockwise.
 * It can be assembled in [-3.14159, 3.14159] rad.
 * A call takes at most 7 poses.
 */
#ifndef LEVER_LINKAGE_H
#define LEVER_LINKAGE_H

#ifndef LKR_MAX_INPUTS
#define LKR_MAX_INPUTS 1
#endif
#ifndef LKR_MAX_SOLUTIONS
#define LKR_MAX_SOLUTIONS 2
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

/* Joints that are not commanded, at most. */
#ifndef LKR_MAX_PASSIVE
#define LKR_MAX_PASSIVE 0
#endif
#define LKR_MAX_JOINTS (LKR_MAX_INPUTS + LKR_MAX_PASSIVE)

#if LKR_FLOAT
typedef float lkr_real;
#define LKR_MATH(name) name##f
#define LKR_OF(in_double, in_float) in_float
#elif DBL_MANT_DIG < 53
#error "double is a float on this machine: print the header again with --float"
#else
typedef double lkr_real;
#define LKR_MATH(name) name
#define LKR_OF(in_double, in_float) in_double
#endif

/* A Jacobian below this part of its size is singular. */
#define LKR_SINGULAR LKR_OF(1e-6, 1e-3f)
/* A command may be so far beyond a sweep: half of all digits, which next to an extreme is rounding. */
#define LKR_BEYOND LKR_OF(1e-6, 5e-4f)
/* Rounding of inputs, and of a pose at them. */
#define LKR_ROUNDING (4 * LKR_OF(DBL_EPSILON, FLT_EPSILON))
/* A position is reached at ENOUGH; where rounding allows no less, CLOSE times the rate or STEEPEST
   may be left [rad, sizes]. */
#define LKR_ENOUGH LKR_OF(1e-14, 2e-6f)
#define LKR_CLOSE LKR_OF(1e-13, 4e-6f)
#define LKR_STEEPEST LKR_OF(4e6, 1e3f)
/* Terms of a series. */
#define LKR_TERMS LKR_OF(20, 8)
#define LKR_NAN ((lkr_real)NAN)
/* Where there is no sweep it ends in infinity; tcc has no -INFINITY in a table. */
#define LKR_ENDLESS LKR_OF(2 * DBL_MAX, 2 * FLT_MAX)
/* A solution that misses by more than this belongs to another assembly [rad, sizes]. */
#define LKR_OTHER ((lkr_real)0.01)

/* Formulas are inlined wherever a pose is needed, so that only what is used there is computed. */
#ifdef __GNUC__
#define LKR_FORMULA static inline __attribute__((always_inline))
#define LKR_PURE static __attribute__((const, noinline, unused))
#else
#define LKR_FORMULA static inline
#define LKR_PURE static inline
#endif

/* A struct of zeros; memset would keep it in memory. */
#ifdef __cplusplus
#define LKR_ZERO { }
#else
#define LKR_ZERO { 0 }
#endif

/* Series stay in the flash memory of an AVR, which has another address space than its RAM. */
#ifdef __AVR__
#include <avr/pgmspace.h>
#define LKR_IN_FLASH PROGMEM
#define LKR_FROM_FLASH(number) pgm_read_float(&(number))
#else
#define LKR_IN_FLASH
#define LKR_FROM_FLASH(number) (number)
#endif

/* --- numbers --- */

/* The larger one, quicker than fmax; b is left out if it is NaN. */
static inline lkr_real lkr_max(lkr_real a, lkr_real b)
{
    return b > a ? b : a;
}

static inline lkr_real lkr_clamped(lkr_real x, lkr_real low, lkr_real high)
{
    return x > high ? high : lkr_max(x, low);
}

/* The whole turns nearest to x. */
LKR_FORMULA lkr_real lkr_turns(lkr_real x, lkr_real turn)
{
    const lkr_real twice = 2 * LKR_MATH(fabs)(x);
    if (twice <= turn) {
        return 0;
    }
    /* A microcontroller divides slowly. */
    return twice <= 3 * turn ? LKR_MATH(copysign)(turn, x)
        : turn * LKR_MATH(floor)(x / turn + (lkr_real)0.5);
}

/* x in the turn nearest to `near`. */
LKR_FORMULA lkr_real lkr_near(lkr_real x, lkr_real near, lkr_real turn)
{
    return x - lkr_turns(x - near, turn);
}

/* A limit that is missed by rounding counts as reached. */
static inline lkr_real lkr_root(lkr_real x, lkr_real tolerance)
{
    if (x > 0) {
        return LKR_MATH(sqrt)(x);
    }
    return x >= -tolerance ? 0 : LKR_NAN;
}

static inline lkr_real lkr_valid_where(lkr_real x, lkr_real margin, lkr_real tolerance)
{
    return margin >= -tolerance ? x : LKR_NAN;
}

/* The angle of (x, y); a compiler leaves it out where it is not used. */
LKR_PURE lkr_real lkr_angle(lkr_real y, lkr_real x)
{
    return LKR_MATH(atan2)(y, x);
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

/* --- types --- */

/* The two sides of a linkage. */
enum { LKR_ACTUATORS = 0, LKR_JOINTS = 1 };

/* Status of a call: 0, or a sum of these. OUT_OF_REACH: outside the reach or the sweep. SINGULAR: a
   velocity or an effort would be infinite. NOT_KNOWN: a value is NaN or infinite, which of a command
   means that there is none. */
enum { LKR_OK = 0, LKR_OUT_OF_REACH = 1, LKR_SINGULAR_POSE = 2, LKR_NOT_KNOWN = 4 };

/* Positions, velocities and efforts of the actuators, or of the joints. */
typedef struct {
    lkr_real position[LKR_MAX_JOINTS];
    lkr_real velocity[LKR_MAX_JOINTS];
    lkr_real effort[LKR_MAX_JOINTS];
} lkr_side;

/* A pose: positions of the actuators [0] and the joints [1], their rates by each input, and the inputs'
   efforts against the loads. */
typedef struct {
    lkr_real position[2][LKR_MAX_JOINTS];
    lkr_real rate[2][LKR_MAX_JOINTS][LKR_MAX_INPUTS];
    lkr_real load[LKR_MAX_INPUTS];
} lkr_point;

/* An actuator or a joint. */
typedef struct {
    /* One over the size of the position, and what it may change by without effect, or INFINITY. */
    lkr_real scale, turn;
} lkr_axis;

/* An input: its size and one over it, its sweep. */
typedef struct {
    lkr_real size, scale, low, high;
    /* After how much of it the actuators or the joints repeat, or INFINITY. */
    lkr_real turn[2];
} lkr_input;

/* A linkage. Inputs q are in the scene's units. */
typedef struct {
    int inputs;
    /* The number of actuators, as many as inputs, and of joints: first as many that are commanded. */
    int count[2];
    /* The pose at inputs, with rates and loads if has_rates; returns 0 if it cannot be assembled. */
    int (*at)(const lkr_real *q, int has_rates, lkr_point *p);
    /* All inputs that a side's positions may have, NaN where there is none; returns their number. */
    int (*solutions[2])(const lkr_real *position, lkr_real (*q)[LKR_MAX_INPUTS]);
    lkr_axis axis[2][LKR_MAX_JOINTS];
    lkr_input input[LKR_MAX_INPUTS];
    /* Where the inputs start. */
    lkr_real start[LKR_MAX_INPUTS];
} lkr_model;

/* A part of the reach in which an output only rises, or only falls: the middle of its values and how
   far it goes from there; the inputs at its ends; the input as a power series of
   sqrt((value - middle) * scale + shift) - center, which is in [-1, 1]. */
typedef struct {
    lkr_real middle, reach, low, high, scale, shift, center;
    lkr_real term[LKR_TERMS];
} lkr_piece;

/* The state between calls: the last pose and its inputs, whether there is one yet, and what is
   held: the positions of the actuators where they were last commanded or measured, whichever is newer,
   of the joints where they were last measured, NaN before; the last efforts. */
typedef struct {
    lkr_point point;
    lkr_real q[LKR_MAX_INPUTS];
    int is_known;
    lkr_side held[2];
} lkr_memory;

/* --- positions at a pose --- */

/* Gaps from a pose to positions, the shorter way round; returns their sum, in sizes. */
static inline lkr_real lkr_gap(const lkr_model *model, int side, const lkr_real *position,
    const lkr_point *p, lkr_real *gap)
{
    lkr_real sum = 0;
    int i;
    for (i = 0; i < model->inputs; i++) {
        const lkr_axis *axis = &model->axis[side][i];
        gap[i] = lkr_near(position[i] - p->position[side][i], 0, axis->turn);
        sum += LKR_MATH(fabs)(gap[i]) * axis->scale;
    }
    return sum;
}

/* Solve J x = b in place, b in x, with the rates J of a side's positions by the inputs, or with their
   transpose. Returns 0 where J is singular, all in sizes. */
static inline int lkr_solve(const lkr_model *model, int side, const lkr_point *p, int is_transposed,
    lkr_real *x)
{
    /* A compiler knows this bound. */
    const int n = model->inputs < LKR_MAX_INPUTS ? model->inputs : LKR_MAX_INPUTS;
    /* The last column is that of b. */
    lkr_real a[LKR_MAX_INPUTS][LKR_MAX_INPUTS + 1] = { { 0 } };
    lkr_real most = 1;
    int i, j, k;
    for (i = 0; i < n; i++) {
        const lkr_real scale = model->axis[side][i].scale;
        for (j = 0; j < n; j++) {
            const lkr_real rate = p->rate[side][i][j] * scale * model->input[j].size;
            a[is_transposed ? j : i][is_transposed ? i : j] = rate;
            most = lkr_max(most, LKR_MATH(fabs)(rate));
        }
        a[i][n] = x[i] * (is_transposed ? model->input[i].size : scale);
    }
    for (k = 0; k < n; k++) {
        lkr_real pivot;
        int best = k;
        for (i = k + 1; i < n; i++) {
            best = LKR_MATH(fabs)(a[i][k]) > LKR_MATH(fabs)(a[best][k]) ? i : best;
        }
        pivot = a[best][k];
        if (!(LKR_MATH(fabs)(pivot) > LKR_SINGULAR * most)) {
            return 0;
        }
        for (j = k; j <= n; j++) {
            const lkr_real value = a[best][j] / pivot;
            a[best][j] = a[k][j];
            a[k][j] = value;
        }
        for (i = 0; i < n; i++) {
            const lkr_real factor = i == k ? 0 : a[i][k];
            for (j = k; j <= n; j++) {
                a[i][j] -= factor * a[k][j];
            }
        }
    }
    for (i = 0; i < n; i++) {
        x[i] = a[i][n] * (is_transposed ? model->axis[side][i].scale : model->input[i].size);
    }
    return lkr_are_finite(n, x);
}

/* --- the inverse --- */

/* The input in each piece of the reach that has a value of an output, of such a size and period. */
static inline int lkr_series(int count, const lkr_piece *piece, lkr_real size, lkr_real turn,
    lkr_real value, lkr_real (*q)[LKR_MAX_INPUTS])
{
    int i, k, solutions = 0;
    for (k = 0; k < count && solutions < LKR_MAX_SOLUTIONS; k++) {
        const lkr_piece *part = &piece[k];
        const lkr_real gap = lkr_near(value - LKR_FROM_FLASH(part->middle), 0, turn);
        if (LKR_MATH(fabs)(gap) <= LKR_FROM_FLASH(part->reach) + LKR_CLOSE * size) {
            const lkr_real square =
                gap * LKR_FROM_FLASH(part->scale) + LKR_FROM_FLASH(part->shift);
            const lkr_real x =
                LKR_MATH(sqrt)(lkr_max(0, square)) - LKR_FROM_FLASH(part->center);
            lkr_real sum = LKR_FROM_FLASH(part->term[LKR_TERMS - 1]);
            for (i = LKR_TERMS - 2; i >= 0; i--) {
                sum = sum * x + LKR_FROM_FLASH(part->term[i]);
            }
            q[solutions][0] =
                lkr_clamped(sum, LKR_FROM_FLASH(part->low), LKR_FROM_FLASH(part->high));
            solutions++;
        }
    }
    return solutions;
}

/* How far rounding of inputs may move positions, in sizes. */
static inline lkr_real lkr_rounding(const lkr_model *model, const lkr_real *q)
{
    lkr_real most = 0;
    int i;
    for (i = 0; i < model->inputs; i++) {
        most = lkr_max(most, LKR_MATH(fabs)(q[i]) * model->input[i].scale);
    }
    return LKR_ROUNDING * most;
}

/* Whether what is left may be rounding: of the positions; of the inputs, where a position changes fast.
   At an end of the reach the rate is infinite, yet rounding is not. */
static inline int lkr_is_rounding(const lkr_model *model, int side, const lkr_real *position,
    const lkr_real *q, const lkr_point *p, lkr_real left)
{
    lkr_real steepest = 1;
    int i, j;
    for (i = 0; i < model->inputs; i++) {
        const lkr_real scale = model->axis[side][i].scale;
        steepest = lkr_max(steepest, LKR_MATH(fabs)(position[i]) * scale);
        for (j = 0; j < model->inputs; j++) {
            steepest = lkr_max(steepest, LKR_MATH(fabs)(p->rate[side][i][j]) * scale
                * lkr_max(model->input[j].size, LKR_MATH(fabs)(q[j])));
        }
    }
    return left <= LKR_CLOSE * lkr_clamped(steepest, 1, LKR_STEEPEST);
}

/* From inputs q to those of positions next to them, and their pose, see lkr_model.at; returns 0 if
   there are none, 1 if they are q, else 2. One step of Newton's method is enough: it squares
   what is left, but next to an extreme, where what is left is rounding of the positions. */
static inline int lkr_refine(const lkr_model *model, int side, const lkr_real *position,
    int has_rates, lkr_real *q, lkr_point *p)
{
    lkr_real gap[LKR_MAX_INPUTS] = { 0 };
    lkr_real x[LKR_MAX_INPUTS];
    lkr_real left = LKR_OTHER;
    int is_rounding = 0;
    int i, step;
    memcpy(x, q, sizeof x);
    for (step = 1; step <= 2; step++) {
        const lkr_real now =
            model->at(x, has_rates, p) ? lkr_gap(model, side, position, p, gap) : INFINITY;
        if (!(now < left)) {
            break;
        }
        left = now;
        memcpy(q, x, sizeof x);
        if (left <= LKR_ENOUGH || left <= lkr_rounding(model, q)) {
            return step;
        }
        has_rates = has_rates || model->at(q, 1, p);
        is_rounding = lkr_is_rounding(model, side, position, q, p, left);
        memcpy(x, gap, sizeof x);
        if (!lkr_solve(model, side, p, 0, x)) {
            break;
        }
        for (i = 0; i < model->inputs; i++) {
            x[i] += q[i];
        }
    }
    return is_rounding ? 2 : 0;
}

/* How far x is beyond the sweep. */
static inline lkr_real lkr_beyond(const lkr_input *input, lkr_real x)
{
    return LKR_MATH(fabs)(x - lkr_clamped(x, input->low, input->high));
}

/* Turn inputs to where they are nearest to near ones and the sweeps; returns how far they are from
   near ones, INFINITY or NAN if not allowed. A command has to be in the sweeps, up to rounding. What
   is measured may be outside, which counts ten times more. */
static inline lkr_real lkr_bring(const lkr_model *model, int side, const lkr_real *near,
    lkr_real *q)
{
    lkr_real away = 0;
    int i;
    for (i = 0; i < model->inputs; i++) {
        const lkr_input *input = &model->input[i];
        lkr_real inside;
        q[i] += lkr_turns(near[i] - q[i], input->turn[side]);
        inside = lkr_clamped(q[i], input->low, input->high);
        if (q[i] != inside) {
            const lkr_real slack = LKR_BEYOND * input->size;
            const lkr_real turn = q[i] < inside ? input->turn[side] : -input->turn[side];
            if (lkr_beyond(input, q[i]) > slack
                && lkr_beyond(input, q[i] + turn) < lkr_beyond(input, q[i])) {
                q[i] += turn;
            }
            if (side == LKR_JOINTS) {
                if (lkr_beyond(input, q[i]) > slack) {
                    return INFINITY;
                }
                q[i] = lkr_clamped(q[i], input->low, input->high);
            }
            away += 10 * lkr_beyond(input, q[i]) * input->scale;
        }
        away += LKR_MATH(fabs)(q[i] - near[i]) * input->scale;
    }
    return away;
}

/* From positions to the inputs q nearest to `from`, and their pose, see lkr_model.at; returns 0,
   and leaves q alone, if there are none. */
static inline int lkr_inverse(const lkr_model *model, int side, const lkr_real *position,
    const lkr_real *from, int has_rates, lkr_real *q, lkr_point *p)
{
    const size_t size = (size_t)model->inputs * sizeof *q;
    lkr_real x[LKR_MAX_SOLUTIONS][LKR_MAX_INPUTS];
    lkr_real away[LKR_MAX_SOLUTIONS + 1];
    lkr_real near[LKR_MAX_INPUTS] = { 0 };
    const int count = model->solutions[side](position, x);
    int i, k;
    for (i = 0; i < model->inputs; i++) {
        near[i] = lkr_clamped(from[i], model->input[i].low, model->input[i].high);
    }
    for (k = 0; k < count; k++) {
        away[k] = lkr_bring(model, side, near, x[k]);
    }
    away[count] = INFINITY;
    for (;;) {
        int nearest = count, found;
        for (k = 0; k < count; k++) {
            nearest = away[k] < away[nearest] ? k : nearest;
        }
        if (nearest == count) {
            return 0;
        }
        away[nearest] = INFINITY;
        found = lkr_refine(model, side, position, has_rates, x[nearest], p);
        /* Newton's method may leave a sweep: then the pose is that at its end. */
        if (found == 1 || (found && lkr_bring(model, side, near, x[nearest]) < INFINITY
                && model->at(x[nearest], has_rates, p))) {
            memcpy(q, x[nearest], size);
            return 1;
        }
    }
}

/* --- actuators and joints --- */

/* Initialize the memory. */
static inline void lkr_begin(const lkr_model *model, lkr_memory *m)
{
    int i;
    memset(m, 0, sizeof *m);
    memcpy(m->q, model->start, sizeof m->q);
    for (i = 0; i < LKR_MAX_JOINTS; i++) {
        m->held[LKR_ACTUATORS].position[i] = LKR_NAN;
        m->held[LKR_JOINTS].position[i] = LKR_NAN;
    }
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

/* Find the pose of positions, and keep it as the newest; returns a status. */
static inline int lkr_move(const lkr_model *model, lkr_memory *m, int side, const lkr_real *position)
{
    lkr_real q[LKR_MAX_INPUTS], gap[LKR_MAX_INPUTS];
    lkr_point p = m->point;
    int i;
    if (!lkr_are_finite(model->inputs, position)) {
        return LKR_NOT_KNOWN;
    }
    memcpy(q, m->q, sizeof q);
    /* Where it is already it stays, whatever rounding says; but a command has to be in the sweeps. */
    if ((!m->is_known || lkr_gap(model, side, position, &p, gap) > LKR_ENOUGH
            || lkr_bring(model, side, m->q, q) != 0)
        && !lkr_inverse(model, side, position, m->q, 1, q, &p)) {
        return LKR_OUT_OF_REACH;
    }
    for (i = 0; side == LKR_JOINTS && i < model->inputs; i++) {
        /* An actuator goes on in the turn in which it is. */
        const lkr_real near = m->held[LKR_ACTUATORS].position[i];
        if (isfinite(near)) {
            p.position[LKR_ACTUATORS][i] =
                lkr_near(p.position[LKR_ACTUATORS][i], near, model->axis[LKR_ACTUATORS][i].turn);
        }
    }
    m->is_known = 1;
    m->point = p;
    memcpy(m->q, q, sizeof q);
    lkr_copy(model->count[1 - side], p.position[1 - side], m->held[1 - side].position);
    return LKR_OK;
}

/* From velocities at a pose to those of the other side, or 0; returns a status. */
static inline int lkr_velocities(const lkr_model *model, const lkr_point *p, int side,
    const lkr_real *velocity, lkr_real *other)
{
    lkr_real speed[LKR_MAX_INPUTS] = { 0 };
    int status = LKR_OK;
    int i, j;
    memset(other, 0, LKR_MAX_JOINTS * sizeof *other);
    if (!lkr_are_finite(model->inputs, velocity)) {
        return LKR_NOT_KNOWN;
    }
    memcpy(speed, velocity, sizeof speed);
    if (!lkr_solve(model, side, p, 0, speed)) {
        return LKR_SINGULAR_POSE;
    }
    for (i = 0; i < model->count[1 - side]; i++) {
        lkr_real sum = 0;
        for (j = 0; j < model->inputs; j++) {
            sum += p->rate[1 - side][i][j] * speed[j];
        }
        if (isfinite(sum)) {
            other[i] = sum;
        } else if (i < model->inputs) {
            status = LKR_SINGULAR_POSE;
        }
    }
    return status;
}

/* The same for efforts, in the place of those before if it can be. The power of the actuators is that
   of the joints less that of the loads. */
static inline int lkr_efforts(const lkr_model *model, const lkr_point *p, int side,
    const lkr_real *effort, lkr_real *other)
{
    const int n = model->inputs;
    lkr_real x[LKR_MAX_INPUTS] = { 0 };
    int i, j;
    if (!lkr_are_finite(n, effort)) {
        return LKR_NOT_KNOWN;
    }
    for (i = 0; i < n; i++) {
        x[i] = side == LKR_JOINTS ? p->load[i] : -p->load[i];
        for (j = 0; j < n; j++) {
            x[i] += p->rate[side][j][i] * effort[j];
        }
    }
    if (!lkr_solve(model, 1 - side, p, 1, x)) {
        return LKR_SINGULAR_POSE;
    }
    lkr_copy(n, x, other);
    return LKR_OK;
}

/* From one side's positions, velocities and efforts to the other's; returns a status. A position or
   an effort without a value is held, a velocity is 0. What is not commanded is not written. */
static inline int lkr_transmit(const lkr_model *model, lkr_memory *m, int side, const lkr_side *from,
    lkr_side *to)
{
    const int count = model->count[1 - side];
    const int missing = side == LKR_JOINTS ? LKR_NOT_KNOWN : 0;
    /* Commanded efforts act where the actuators are, not where they are commanded to be. */
    const int is_here = side == LKR_JOINTS && m->is_known;
    const lkr_point here = m->point;
    lkr_side *held = &m->held[1 - side];
    int position, velocity, effort;
    if (side == LKR_ACTUATORS) {
        /* Where an actuator is measured is newer than its command, within the reach or not. */
        lkr_copy(model->inputs, from->position, m->held[LKR_ACTUATORS].position);
    }
    position = lkr_move(model, m, side, from->position);
    velocity = lkr_velocities(model, &m->point, side, from->velocity, held->velocity);
    effort = lkr_efforts(model, is_here ? &here : &m->point, side, from->effort, held->effort);
    if (!m->is_known) {
        velocity = LKR_NOT_KNOWN;
        effort = LKR_NOT_KNOWN;
    }
    if (position == LKR_OUT_OF_REACH) {
        memset(held->velocity, 0, sizeof held->velocity);
        velocity &= LKR_NOT_KNOWN;
    }
    if (effort & missing) {
        /* What was commanded before a pause is not held after it. */
        memset(held->effort, 0, sizeof held->effort);
    }
    lkr_copy((position & missing) ? 0 : count, held->position, to->position);
    lkr_copy((velocity & missing) ? 0 : count, held->velocity, to->velocity);
    lkr_copy((effort & missing) ? 0 : model->inputs, held->effort, to->effort);
    return position | velocity | effort;
}

#endif /* LINKAGE_ROS_LINKAGE_H */
#if LKR_FLOAT != 1 || LKR_MAX_INPUTS < 1 || LKR_MAX_SOLUTIONS < 2
#error "lever needs LKR_FLOAT 1, LKR_MAX_INPUTS 1 or more, and LKR_MAX_SOLUTIONS 2 or more"
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

/* The pose; with has_rates, rates by crank. Returns 0 beyond a limit. */
LKR_FORMULA int lever_formulas(float crank_, int has_rates, lever_pose *p,
    lever_pose *by_crank)
{
    const float length_a = 0.02f;
    const float k2 = -0.045f; /* -b */
    const float k19 = 0.04f; /* 2.0 * a */
    const float k23 = 0.025f; /* b - a */
    const float k24 = 0.000625f; /* (b - a) * (b - a) */
    const float k27 = 0.0036f; /* (4.0 * b) * a */
    const float k48 = 0.081f; /* 1.8 * b */
    const float k70 = 0.000625f;
    const float k77 = 0.0f;
    const float k82 = -0.025f; /* a - b */
    const float k83 = 0.09f; /* 2.0 * b */
    const float x0 = crank_;
    /* O ground 0 0 */
    p->O_x = 0.0f;
    p->O_y = 0.0f;
    /* Q ground 0 -b */
    p->Q_x = 0.0f;
    p->Q_y = k2;
    /* A crank O a up */
    const float v6 = 0.5f * x0;
    const float v7 = sinf(v6);
    const float v9 = cosf(v6);
    const float v13 = -(((2.0f * v7) * v9) * length_a);
    const float v18 = (1.0f - (2.0f * (v7 * v7))) * length_a;
    p->A_x = v13;
    p->A_y = v18;
    p->angle_crank = x0;
    /* L slot Q A e out max(1.8*b,a+b) */
    const float v28 = v9 * v9;
    const float v29 = k27 * v28;
    const float v30 = k24 + v29;
    const float v34 = lkr_valid_where(v30, (v28 + 1.0f) - 7.888609e-31f, 0.0f);
    const float v35 = lkr_valid_where(-((k19 * v7) * v9), v34, 0.0f);
    const float v39 = lkr_valid_where(k23 + (k19 * v28), v34, 0.0f);
    const float v42 = sqrtf((v35 * v35) + (v39 * v39));
    const float v43 = v35 / v42;
    const float v50 = v39 / v42;
    const float v78 = lkr_root(k70 + v29, k77);
    p->L_x = v43 * k48;
    p->L_y = k2 + (v50 * k48);
    p->angle_lever = lkr_angle(-v43, v50);
    p->slide_slide = v78;
    const float valid = 0.0f;
    if (!has_rates) {
        return isfinite(valid);
    }
    /* Rates of O ground 0 0 */
    by_crank->O_x = 0.0f;
    by_crank->O_y = 0.0f;
    /* Rates of Q ground 0 -b */
    by_crank->Q_x = 0.0f;
    by_crank->Q_y = 0.0f;
    /* Rates of A crank O a up */
    by_crank->A_x = -v18;
    by_crank->A_y = v13;
    by_crank->angle_crank = lkr_valid_where(1.0f, fabsf(x0), 0.0f);
    /* Rates of L slot Q A e out max(1.8*b,a+b) */
    const float v88 = ((length_a * (k82 + (k83 * v28))) / v30) + 0.0f;
    by_crank->L_x = -((v88 * v50) * k48);
    by_crank->L_y = (v88 * v43) * k48;
    by_crank->angle_lever = v88;
    by_crank->slide_slide = (-((((v7 * 0.5f) * v9) * 2.0f) * k27)) / (2.0f * v78);
    return isfinite(valid);
}

/* Place the joints. Return 0 if not all can be assembled: NaN is what cannot. */
static inline int lever_solve(float crank_, lever_pose *p)
{
    lever_pose by_crank;
    (void)lever_formulas(crank_, 0, p, &by_crank);
    return isfinite(p->O_x + p->O_y + p->Q_x + p->Q_y + p->A_x + p->A_y + p->L_x + p->L_y +
        p->angle_crank + p->angle_lever + p->slide_slide);
}

/* Differentiate all of it by crank. */
static inline void lever_rates(float crank_, lever_pose *by_crank)
{
    lever_pose p;
    (void)lever_formulas(crank_, 1, &p, by_crank);
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

/* The inputs. */
static inline int lever_solutions_angle_crank(const float *position,
    float (*q)[LKR_MAX_INPUTS])
{
    const float x0 = position[0];
    q[0][0] = x0;
    return 1;
}

/* The inputs in each assembly mode of the inverse linkage, NAN where there is none:
     O ground 0.0 0.0
     Q ground 0.0 -0.045
     L crank Q 0.081 up
     A slider O 0.02 Q along L out
 */
static inline int lever_solutions_angle_lever(const float *position,
    float (*q)[LKR_MAX_INPUTS])
{
    const float x0 = position[0];
    /* A left */
    const float v3 = 0.5f * x0;
    const float v4 = sinf(v3);
    const float v7 = (2.0f * v4) * cosf(v3);
    const float v10 = v7 * 0.045f;
    const float v15 = lkr_root((0.02f + v10) * (0.02f - v10), 6.198883e-10f);
    const float v21 = 1.0f - (2.0f * (v4 * v4));
    const float v22 = v21 * v10;
    const float v26 = -(v7 * v10);
    q[0][0] = lkr_angle(-((-(v7 * v15)) - v22), v26 + (v21 * v15));
    /* A right */
    q[1][0] = lkr_angle(-((v15 * v7) - v22), v26 - (v15 * v21));
    return 2;
}

/* Positions, and rates if has_rates, else 0, at inputs; returns 0 if it cannot be assembled. */
static inline int lever_at(const float *q, int has_rates, lkr_point *p)
{
    lever_pose s, by_crank = LKR_ZERO;
    if (!lever_formulas(q[0], has_rates, &s, &by_crank)) {
        return 0;
    }
    p->position[0][0] = s.angle_crank;
    p->rate[0][0][0] = by_crank.angle_crank;
    p->position[1][0] = s.angle_lever;
    p->rate[1][0][0] = by_crank.angle_lever;
    p->load[0] = 0.0f;
    return isfinite(p->position[0][0] + p->position[1][0]);
}

/* Tables of the actuators and joints, see lkr_model. */
static const lkr_model lever_model = {
    1, { 1, 1 }, lever_at, { lever_solutions_angle_crank, lever_solutions_angle_lever },
    /* The actuators, the joints, the inputs and their starts. */
    { { { 1.0f, INFINITY } }, { { 1.0f, 6.2831855f } } },
    { { 1.0f, 1.0f, -LKR_ENDLESS, LKR_ENDLESS, { INFINITY, 6.2831855f } } }, { 0.0f }
};

/* Positions, and rates if has_rates, else 0, at inputs; returns 0 if it cannot be assembled. */
static inline int lever_at_angle_lever(const float *q, int has_rates, lkr_point *p)
{
    lever_pose s, by_crank = LKR_ZERO;
    if (!lever_formulas(q[0], has_rates, &s, &by_crank)) {
        return 0;
    }
    p->position[1][0] = s.angle_lever;
    p->rate[1][0][0] = by_crank.angle_lever;
    return isfinite(p->position[1][0]);
}

/* Tables of the inverse, see lkr_model. */
static const lkr_model lever_model_angle_lever = {
    1, { 0, 1 }, lever_at_angle_lever, { 0, lever_solutions_angle_lever },
    /* The actuators, the joints, the inputs and their starts. */
    { { { 0, 0 } }, { { 1.0f, 6.2831855f } } },
    { { 1.0f, 1.0f, -LKR_ENDLESS, LKR_ENDLESS, { 6.2831855f, 6.2831855f } } }, { 0.0f }
};

/* The crank for lever [rad], nearest to `near`, whole turns included.
   Returns 0, and leaves crank alone, where there is none. */
static inline int lever_crank_for_angle_lever(float value, float near, float *crank_)
{
    lkr_point p;
    return lkr_inverse(&lever_model_angle_lever, LKR_JOINTS, &value, &near, 0, crank_, &p);
}

/* Initialize the memory; returns 1. */
static inline int lever_begin(lever_memory *m)
{
    lkr_begin(&lever_model, m);
    return 1;
}

/* From actuators to joints, see lkr_transmit; returns a status. */
static inline int lever_actuators_to_joints(lever_memory *m, const lever_actuators *from,
    lever_joints *to)
{
    return lkr_transmit(&lever_model, m, LKR_ACTUATORS, from, to);
}

/* From joints to actuators, see lkr_transmit; returns a status. */
static inline int lever_joints_to_actuators(lever_memory *m, const lever_joints *from,
    lever_actuators *to)
{
    return lkr_transmit(&lever_model, m, LKR_JOINTS, from, to);
}

#endif /* LEVER_LINKAGE_H */

