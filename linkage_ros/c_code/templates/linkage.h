// SPDX-FileCopyrightText: 2026 linkage_ros contributors
// SPDX-License-Identifier: Apache-2.0

/*
 * What the headers of all linkages have in common: names that begin with lkr_ or LKR_.
 *
 * A generated header has the formulas and tables of one linkage; here is how they are used: the
 * inverse, and the conversion between actuators and joints. C99 and C++17 with the attributes of
 * gcc, without heap, lock, recursion or exception; every loop is bounded. Compile without
 * -ffast-math, which drops the checks.
 */
#ifndef LINKAGE_ROS_LINKAGE_H
#define LINKAGE_ROS_LINKAGE_H

#include <float.h>
#include <math.h>
#include <string.h>

#if DBL_MANT_DIG < 53 && LKR_OF(1, 0)
#error "double is a float on this machine: print the header again with --float"
#endif

/* A Jacobian with a smaller pivot than this part of its largest element is singular. */
#define LKR_MIN_PIVOT LKR_OF(1e-6, 1e-3f)
/* Residuals of a position [rad, sizes]: a smaller one than CONVERGED needs no correction, and after one
   TOLERANCE is allowed. Both are times lkr_condition, in which rates count up to MAX_RATE. */
#define LKR_CONVERGED LKR_OF(1e-14, 2e-6f)
#define LKR_TOLERANCE LKR_OF(1e-13, 4e-6f)
#define LKR_MAX_RATE LKR_OF(4e6, 1e3f)
/* Terms of a series. */
#define LKR_TERMS LKR_OF(20, 8)
#define LKR_NAN ((lkr_real)NAN)
/* The end of an input without a sweep is infinite; tcc has no -INFINITY in a table. */
#define LKR_UNLIMITED LKR_OF(2 * DBL_MAX, 2 * FLT_MAX)
/* A solution with a larger residual belongs to another assembly [rad, sizes]. */
#define LKR_OTHER_ASSEMBLY ((lkr_real)0.01)

/* Formulas are inlined wherever a pose is needed, so that only what is used there is computed. */
#define LKR_FORMULA static inline __attribute__((always_inline))

/* An array of structs of zeros; memset would keep it in memory. */
#ifdef __cplusplus
#define LKR_ZEROS { }
#else
#define LKR_ZEROS { { 0 } }
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

/* The larger number, quicker than fmax; a if b is NaN. */
static inline lkr_real lkr_max(lkr_real a, lkr_real b)
{
    return b > a ? b : a;
}

static inline lkr_real lkr_clamp(lkr_real x, lkr_real low, lkr_real high)
{
    return x > high ? high : lkr_max(x, low);
}

/* The whole turns nearest to x, 0 for NaN. */
LKR_FORMULA lkr_real lkr_turns(lkr_real x, lkr_real turn)
{
    return 2 * LKR_MATH(fabs)(x) > turn ? turn * LKR_MATH(floor)(x / turn + (lkr_real)0.5) : 0;
}

/* x plus the whole turns that bring it nearest to a center. */
LKR_FORMULA lkr_real lkr_wrapped(lkr_real x, lkr_real center, lkr_real turn)
{
    return x - lkr_turns(x - center, turn);
}

/* x, or NaN if a margin is negative by more than rounding. */
static inline lkr_real lkr_valid_where(lkr_real x, lkr_real margin, lkr_real tolerance)
{
    return margin >= -tolerance ? x : LKR_NAN;
}

/* The square root, of a number that is negative by rounding 0. */
static inline lkr_real lkr_root(lkr_real x, lkr_real tolerance)
{
    return LKR_MATH(sqrt)(x > 0 ? x : lkr_valid_where(0, x, tolerance));
}

/* The angle of (x, y); a compiler leaves it out where it is not used. */
static __attribute__((const, noinline, unused)) lkr_real lkr_angle(lkr_real y, lkr_real x)
{
    return LKR_MATH(atan2)(y, x);
}

/* Copy the values that are finite; returns whether all are. */
static inline int lkr_copy(int n, const lkr_real *from, lkr_real *to)
{
    int count = 0;
    int i;
    for (i = 0; i < n; i++) {
        if (isfinite(from[i])) {
            to[i] = from[i];
            count++;
        }
    }
    return count == n;
}

/* --- types --- */

/* The two sides of a linkage. */
enum { LKR_ACTUATORS = 0, LKR_JOINTS = 1 };

/* Status of a call: 0, or a sum of these. OUT_OF_REACH: outside the reach or the sweep. SINGULAR: a
   velocity or an effort would be infinite. NOT_KNOWN: a value is NaN or infinite, which of a command
   means that there is none. */
enum { LKR_OK = 0, LKR_OUT_OF_REACH = 1, LKR_SINGULAR = 2, LKR_NOT_KNOWN = 4 };

/* Positions, velocities and efforts of the actuators, or of the joints. */
typedef struct {
    lkr_real position[LKR_MAX_JOINTS];
    lkr_real velocity[LKR_MAX_JOINTS];
    lkr_real effort[LKR_MAX_JOINTS];
} lkr_side;

/* A pose: inputs in the scene's units, positions of the actuators [0] and the joints [1], their rates
   by each input, and the inputs' efforts against the loads. */
typedef struct {
    lkr_real q[LKR_MAX_INPUTS];
    lkr_real position[2][LKR_MAX_JOINTS];
    lkr_real rate[2][LKR_MAX_JOINTS][LKR_MAX_INPUTS];
    lkr_real load[LKR_MAX_INPUTS];
} lkr_point;

/* An actuator or a joint: its output in the scene is ratio * (position - offset). */
typedef struct {
    lkr_real ratio, offset;
    /* One over the size of the position, and what it may change by without effect, or INFINITY. */
    lkr_real scale, turn;
} lkr_axis;

/* An input: its size and one over it, its sweep. */
typedef struct {
    lkr_real size, scale, low, high;
    /* After how much of it the actuators or the joints repeat, or INFINITY. */
    lkr_real turn[2];
} lkr_input;

/* A linkage. */
typedef struct {
    int inputs;
    /* The number of actuators, as many as inputs, and of joints: first as many that are commanded. */
    int count[2];
    /* The pose at its inputs, with rates and loads if has_rates; returns 0 if it cannot be
       assembled. */
    int (*at)(int has_rates, lkr_point *p);
    /* All inputs that a side's outputs may have, NaN where there is none; returns their number. */
    int (*solutions[2])(const lkr_real *value, lkr_real (*q)[LKR_MAX_INPUTS]);
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

/* The state between calls: the last pose, whether there is one yet, and where positions are held:
   the actuators where they were last commanded or measured, whichever is newer, the joints where they
   were last measured, NaN before. */
typedef struct {
    lkr_point point;
    int is_known;
    lkr_real held[2][LKR_MAX_JOINTS];
} lkr_memory;

/* --- positions at a pose --- */

/* Residuals of positions at a pose, the shorter way round; returns their sum, in sizes. */
static inline lkr_real lkr_residual(const lkr_model *model, int side, const lkr_real *position,
    const lkr_point *p, lkr_real *residual)
{
    lkr_real sum = 0;
    int i;
    for (i = 0; i < model->inputs; i++) {
        const lkr_axis *axis = &model->axis[side][i];
        residual[i] = lkr_wrapped(position[i] - p->position[side][i], 0, axis->turn);
        sum += LKR_MATH(fabs)(residual[i]) * axis->scale;
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
        if (!(LKR_MATH(fabs)(pivot) > LKR_MIN_PIVOT * most)) {
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
    return lkr_copy(n, x, x);
}

/* --- the inverse --- */

/* The input in each piece of the reach that has a value of an output, of such a size and period. */
static inline int lkr_series(int count, const lkr_piece *piece, lkr_real size, lkr_real turn,
    lkr_real value, lkr_real (*q)[LKR_MAX_INPUTS])
{
    int i, k, solutions = 0;
    for (k = 0; k < count && solutions < LKR_MAX_SOLUTIONS; k++) {
        const lkr_piece *part = &piece[k];
        const lkr_real offset = lkr_wrapped(value - LKR_FROM_FLASH(part->middle), 0, turn);
        if (LKR_MATH(fabs)(offset) <= LKR_FROM_FLASH(part->reach) + LKR_TOLERANCE * size) {
            const lkr_real square =
                offset * LKR_FROM_FLASH(part->scale) + LKR_FROM_FLASH(part->shift);
            const lkr_real x =
                LKR_MATH(sqrt)(lkr_max(0, square)) - LKR_FROM_FLASH(part->center);
            lkr_real sum = LKR_FROM_FLASH(part->term[LKR_TERMS - 1]);
            for (i = LKR_TERMS - 2; i >= 0; i--) {
                sum = sum * x + LKR_FROM_FLASH(part->term[i]);
            }
            q[solutions][0] =
                lkr_clamp(sum, LKR_FROM_FLASH(part->low), LKR_FROM_FLASH(part->high));
            solutions++;
        }
    }
    return solutions;
}

/* The condition number of positions: how many times the rounding of numbers of size 1 they have, as
   positions or inputs are large, after many turns, or, with has_rates, as rates are. At an end of the
   reach a rate is infinite, yet rounding is not. */
LKR_FORMULA lkr_real lkr_condition(const lkr_model *model, int side, const lkr_real *position,
    const lkr_point *p, int has_rates)
{
    lkr_real most = 1;
    int i, j;
    for (i = 0; i < model->inputs; i++) {
        const lkr_real scale = model->axis[side][i].scale;
        most = lkr_max(most, LKR_MATH(fabs)(p->q[i]) * model->input[i].scale);
        most = lkr_max(most, LKR_MATH(fabs)(position[i]) * scale);
        for (j = 0; j < model->inputs * has_rates; j++) {
            const lkr_input *input = &model->input[j];
            most = lkr_max(most, lkr_max(1, LKR_MATH(fabs)(p->q[j]) * input->scale)
                * lkr_clamp(LKR_MATH(fabs)(p->rate[side][i][j]) * scale * input->size,
                    0, LKR_MAX_RATE));
        }
    }
    return most;
}

/* How far x is beyond the sweep. */
static inline lkr_real lkr_beyond(const lkr_input *input, lkr_real x)
{
    return LKR_MATH(fabs)(x - lkr_clamp(x, input->low, input->high));
}

/* Add whole turns to inputs, so that they are in the sweeps and next to near ones; returns their
   distance from those, INFINITY if not allowed. A command has to be in the sweeps, up to rounding. A
   measurement may be outside, and this part of the distance counts ten times. */
static inline lkr_real lkr_unwrap(const lkr_model *model, int side, const lkr_real *near,
    lkr_real *q)
{
    lkr_real distance = 0;
    int i;
    for (i = 0; i < model->inputs; i++) {
        const lkr_input *input = &model->input[i];
        lkr_real inside;
        q[i] += lkr_turns(near[i] - q[i], input->turn[side]);
        inside = lkr_clamp(q[i], input->low, input->high);
        if (q[i] != inside) {
            const lkr_real other = q[i] + (q[i] < inside ? input->turn[side] : -input->turn[side]);
            /* Outside by rounding alone is no reason for another turn. */
            const lkr_real rounding = LKR_TOLERANCE * LKR_MAX_RATE * input->size;
            if (lkr_beyond(input, other) + rounding < lkr_beyond(input, q[i])) {
                q[i] = other;
            }
            distance += 10 * lkr_beyond(input, q[i]) * input->scale;
            if (side == LKR_JOINTS) {
                q[i] = lkr_beyond(input, q[i]) > rounding ? LKR_NAN
                    : lkr_clamp(q[i], input->low, input->high);
            }
        }
        distance += LKR_MATH(fabs)(q[i] - near[i]) * input->scale;
    }
    return distance < INFINITY ? distance : INFINITY;
}

/* Correct p to the pose of positions next to its own, see lkr_model.at; returns 0 if there is none. One
   step of Newton's method is enough: it squares the residual, except next to an extreme, where the
   residual may be rounding. */
static inline int lkr_refine(const lkr_model *model, int side, const lkr_real *position,
    int has_rates, lkr_point *p)
{
    lkr_point best;
    lkr_real step[LKR_MAX_INPUTS] = { 0 };
    lkr_real least = LKR_OTHER_ASSEMBLY;
    int is_rounding = 0;
    int i, is_last;
    for (is_last = 0; is_last <= 1; is_last++) {
        const lkr_real error =
            model->at(has_rates, p) ? lkr_residual(model, side, position, p, step) : INFINITY;
        if (error <= LKR_CONVERGED
            || error <= LKR_CONVERGED * lkr_condition(model, side, position, p, 0)) {
            return 1;
        }
        if (!(error < least)) {
            break;
        }
        least = error;
        has_rates = has_rates || model->at(1, p);
        best = *p;
        is_rounding = error <= LKR_TOLERANCE * lkr_condition(model, side, position, p, 1);
        if (is_last || !lkr_solve(model, side, p, 0, step)) {
            break;
        }
        for (i = 0; i < model->inputs; i++) {
            p->q[i] += step[i];
            if (side == LKR_JOINTS) {
                p->q[i] = lkr_clamp(p->q[i], model->input[i].low, model->input[i].high);
            }
        }
    }
    if (is_rounding) {
        *p = best;
    }
    return is_rounding;
}

/* The pose of positions whose inputs are nearest to some, see lkr_model.at; returns 0 if there is
   none. */
static inline int lkr_find(const lkr_model *model, int side, const lkr_real *position,
    const lkr_real *from, int has_rates, lkr_point *p)
{
    lkr_real value[LKR_MAX_INPUTS], near[LKR_MAX_INPUTS];
    lkr_real q[LKR_MAX_SOLUTIONS][LKR_MAX_INPUTS];
    lkr_real distance[LKR_MAX_SOLUTIONS];
    int count, tries, i, k;
    for (i = 0; i < model->inputs; i++) {
        const lkr_axis *axis = &model->axis[side][i];
        value[i] = axis->ratio * (position[i] - axis->offset);
        near[i] = lkr_clamp(from[i], model->input[i].low, model->input[i].high);
    }
    count = model->solutions[side](value, q);
    for (k = 0; k < count; k++) {
        distance[k] = lkr_unwrap(model, side, near, q[k]);
    }
    for (tries = 0; tries < count; tries++) {
        int nearest = count - 1;
        for (k = 0; k < count - 1; k++) {
            nearest = distance[k] < distance[nearest] ? k : nearest;
        }
        memcpy(p->q, q[nearest], sizeof p->q);
        if (distance[nearest] < INFINITY && lkr_refine(model, side, position, has_rates, p)) {
            return 1;
        }
        distance[nearest] = INFINITY;
    }
    return 0;
}

/* The inputs for outputs, nearest to near ones, whole turns included. Returns 0, and leaves inputs
   alone, where there are none. */
static inline int lkr_inverse(const lkr_model *model, const lkr_real *value, const lkr_real *near,
    lkr_real *inputs)
{
    lkr_point p;
    return lkr_find(model, LKR_JOINTS, value, near, 0, &p)
        && lkr_copy(model->inputs, p.q, inputs);
}

/* --- actuators and joints --- */

/* Initialize the memory. */
static inline void lkr_begin(const lkr_model *model, lkr_memory *m)
{
    int i;
    memset(m, 0, sizeof *m);
    memcpy(m->point.q, model->start, sizeof model->start);
    for (i = 0; i < LKR_MAX_JOINTS; i++) {
        m->held[LKR_ACTUATORS][i] = LKR_NAN;
        m->held[LKR_JOINTS][i] = LKR_NAN;
    }
}

/* Find the pose of positions, and keep it as the newest; returns a status. */
static inline int lkr_update(const lkr_model *model, lkr_memory *m, int side, const lkr_real *position)
{
    lkr_real residual[LKR_MAX_INPUTS];
    lkr_point p = m->point;
    int i;
    if (!lkr_copy(model->inputs, position, residual)) {
        return LKR_NOT_KNOWN;
    }
    /* Where it is already it stays, whatever rounding says; but a command has to be in the sweeps. */
    if ((!m->is_known || lkr_residual(model, side, position, &p, residual) > LKR_CONVERGED
            || lkr_unwrap(model, side, m->point.q, p.q) != 0)
        && !lkr_find(model, side, position, m->point.q, 1, &p)) {
        return LKR_OUT_OF_REACH;
    }
    for (i = 0; side == LKR_JOINTS && i < model->inputs; i++) {
        /* An actuator goes on in the turn in which it is. */
        lkr_real *at = &p.position[LKR_ACTUATORS][i];
        *at = lkr_wrapped(*at, m->held[LKR_ACTUATORS][i], model->axis[LKR_ACTUATORS][i].turn);
    }
    m->is_known = 1;
    m->point = p;
    (void)lkr_copy(model->count[1 - side], p.position[1 - side], m->held[1 - side]);
    return LKR_OK;
}

/* From velocities at a pose to those of the other side, or from efforts to efforts, where there are
   any; returns a status. Velocities become those of the inputs by the inverse Jacobian, efforts by the
   transpose, so that the power of the actuators is that of the joints less that of the loads. */
static inline int lkr_convert(const lkr_model *model, const lkr_point *p, int side, int is_effort,
    const lkr_real *from, lkr_real *to)
{
    const int n = model->inputs;
    const int count = is_effort ? n : model->count[1 - side];
    lkr_real x[LKR_MAX_INPUTS] = { 0 };
    lkr_real y[LKR_MAX_JOINTS] = { 0 };
    int i, j;
    if (!lkr_copy(n, from, x)) {
        return LKR_NOT_KNOWN;
    }
    if (!is_effort && !lkr_solve(model, side, p, 0, x)) {
        return LKR_SINGULAR;
    }
    for (i = 0; i < count; i++) {
        if (is_effort) {
            y[i] = side == LKR_JOINTS ? p->load[i] : -p->load[i];
        }
        for (j = 0; j < n; j++) {
            y[i] += (is_effort ? p->rate[side][j][i] : p->rate[1 - side][i][j]) * x[j];
        }
    }
    if (is_effort && !lkr_solve(model, 1 - side, p, 1, y)) {
        return LKR_SINGULAR;
    }
    (void)lkr_copy(count - n, y + n, to + n);
    return lkr_copy(n, y, to) ? LKR_OK : LKR_SINGULAR;
}

/* From one side's positions, velocities and efforts to the other's; returns a status. A position
   without a value is held, a velocity or an effort is 0. What is not commanded is not written, nor
   is anything before a position is known. */
static inline int lkr_transmit(const lkr_model *model, lkr_memory *m, int side, const lkr_side *from,
    lkr_side *to)
{
    const int count = model->count[1 - side];
    const int missing = side == LKR_JOINTS ? LKR_NOT_KNOWN : 0;
    /* Commanded efforts act where the actuators are, not where they are commanded to be. */
    const int is_here = side == LKR_JOINTS && m->is_known;
    const lkr_point here = m->point;
    lkr_real speeds[LKR_MAX_JOINTS] = { 0 };
    lkr_real efforts[LKR_MAX_JOINTS] = { 0 };
    int position, velocity, effort;
    if (side == LKR_ACTUATORS) {
        /* Where an actuator is measured is newer than its command, within the reach or not. */
        (void)lkr_copy(model->inputs, from->position, m->held[LKR_ACTUATORS]);
    }
    position = lkr_update(model, m, side, from->position);
    if (!m->is_known) {
        return position | LKR_NOT_KNOWN;
    }
    velocity = lkr_convert(model, &m->point, side, 0, from->velocity, speeds);
    effort = lkr_convert(model, is_here ? &here : &m->point, side, 1, from->effort, efforts);
    if (position == LKR_OUT_OF_REACH) {
        memset(speeds, 0, sizeof speeds);
        velocity &= LKR_NOT_KNOWN;
    }
    (void)lkr_copy((position & missing) ? 0 : count, m->held[1 - side], to->position);
    (void)lkr_copy((velocity & missing) ? 0 : count, speeds, to->velocity);
    (void)lkr_copy((effort & missing) ? 0 : model->inputs, efforts, to->effort);
    return position | velocity | effort;
}

/* What the joints are where the actuators are measured; returns a status. */
static inline int lkr_actuators_to_joints(const lkr_model *model, lkr_memory *m, const lkr_side *from,
    lkr_side *to)
{
    return lkr_transmit(model, m, LKR_ACTUATORS, from, to);
}

/* What to command the actuators for what the joints are commanded; returns a status. */
static inline int lkr_joints_to_actuators(const lkr_model *model, lkr_memory *m, const lkr_side *from,
    lkr_side *to)
{
    return lkr_transmit(model, m, LKR_JOINTS, from, to);
}

#endif /* LINKAGE_ROS_LINKAGE_H */
