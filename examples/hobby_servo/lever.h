/*
 * lever: slotted_lever, written by linkage_ros.
 * Lengths [m]: a = 0.02, b = 0.045, e = 0.
 * Input: crank [rad]. Angles [rad] count counterclockwise.
 * float: joints are off by up to 1e-07 of the longest bar at 2001 poses over the reach, without its outermost hundredth.
 * C99 and C++17 without heap, lock or recursion; compile without -ffast-math, which drops the checks.
 * A call of the transmission takes at most 18 poses.
 */
#ifndef LEVER_LINKAGE_H
#define LEVER_LINKAGE_H

#include <float.h>
#include <math.h>

/* A limit that is missed by rounding counts as reached. */
static inline float lever_root(float x, float tolerance)
{
    return x > 0.0f ? sqrtf(x) : x >= -tolerance ? 0.0f : (float)NAN;
}

static inline float lever_gated(float x, float margin, float tolerance)
{
    return margin >= -tolerance ? x : (float)NAN;
}

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

/* Place the joints. Return 0 if not all can be assembled: NaN is what cannot. */
static inline int lever_solve(float crank, lever_pose *p)
{
    const float k7 = (-0.045f);
    const float k10 = (-0.045f);
    const float k19 = 0.02f;
    const float k26 = 0.04f;
    const float k30 = 0.025f;
    const float k31 = 0.000625f;
    const float k34 = 0.0036f;
    const float k40 = 1.0f;
    const float k58 = 0.081f;
    const float k77 = 0.000625f;
    const float k84 = 0.0f;
    const float x0 = crank;
    const float v14 = (0.5f * x0);
    const float v15 = sinf(v14);
    const float v17 = cosf(v14);
    const float v35 = (v17 * v17);
    const float v36 = (k34 * v35);
    const float v44 = lever_gated((k31 + v36), ((v35 + k40) - 7.888609e-31f), 0.0f);
    const float v45 = lever_gated((-((k26 * v15) * v17)), v44, 0.0f);
    const float v49 = lever_gated((k30 + (k26 * v35)), v44, 0.0f);
    const float v52 = sqrtf(((v45 * v45) + (v49 * v49)));
    const float v53 = (v45 / v52);
    const float v60 = (v49 / v52);
    p->O_x = 0.0f;
    p->O_y = 0.0f;
    p->Q_x = 0.0f;
    p->Q_y = k10;
    p->A_x = (-(((2.0f * v15) * v17) * k19));
    p->A_y = ((1.0f - (2.0f * (v15 * v15))) * k19);
    p->L_x = (v53 * k58);
    p->L_y = (k7 + (v60 * k58));
    p->angle_crank = x0;
    p->angle_lever = atan2f((-v53), v60);
    p->slide_slide = lever_root((k77 + v36), k84);
    return isfinite(p->O_x)
        && isfinite(p->O_y)
        && isfinite(p->Q_x)
        && isfinite(p->Q_y)
        && isfinite(p->A_x)
        && isfinite(p->A_y)
        && isfinite(p->L_x)
        && isfinite(p->L_y)
        && isfinite(p->angle_crank)
        && isfinite(p->angle_lever)
        && isfinite(p->slide_slide);
}

/* Differentiate all of it by crank. */
static inline void lever_rates(float crank, lever_pose *by_crank)
{
    const float k10 = 0.02f;
    const float k19 = (-0.025f);
    const float k20 = 0.09f;
    const float k25 = 0.025f;
    const float k26 = 0.000625f;
    const float k29 = 0.0036f;
    const float k34 = 0.04f;
    const float k39 = 1.0f;
    const float k59 = 0.081f;
    const float k83 = 0.000625f;
    const float k90 = 0.0f;
    const float x0 = crank;
    const float v5 = (0.5f * x0);
    const float v6 = sinf(v5);
    const float v14 = cosf(v5);
    const float v21 = (v14 * v14);
    const float v30 = (k29 * v21);
    const float v31 = (k26 + v30);
    const float v33 = (((k10 * (k19 + (k20 * v21))) / v31) + 0.0f);
    const float v43 = lever_gated(v31, ((v21 + k39) - 7.888609e-31f), 0.0f);
    const float v44 = lever_gated((k25 + (k34 * v21)), v43, 0.0f);
    const float v48 = lever_gated((-((k34 * v6) * v14)), v43, 0.0f);
    const float v52 = sqrtf(((v48 * v48) + (v44 * v44)));
    by_crank->O_x = 0.0f;
    by_crank->O_y = 0.0f;
    by_crank->Q_x = 0.0f;
    by_crank->Q_y = 0.0f;
    by_crank->A_x = (-((1.0f - (2.0f * (v6 * v6))) * k10));
    by_crank->A_y = (-(((2.0f * v6) * v14) * k10));
    by_crank->L_x = (-((v33 * (v44 / v52)) * k59));
    by_crank->L_y = ((v33 * (v48 / v52)) * k59);
    by_crank->angle_crank = lever_gated(1.0f, fabsf(x0), 0.0f);
    by_crank->angle_lever = v33;
    by_crank->slide_slide = (-(((((v6 * 0.5f) * v14) * 2.0f) * k29) / (2.0f * lever_root((k83 + v30), k90))));
}

/* Whether it can be assembled: [-3.14159, 3.14159] rad. */
static inline int lever_reaches(float crank)
{
    return isfinite(crank);
}

/* Status of a call: 0, or a sum of these. OUT_OF_REACH: outside the reach or the sweep, or not found
   by a search. SINGULAR: a velocity or an effort would be infinite. NOT_KNOWN: a value is NaN or
   infinite, which of a command means that there is none. */
enum { LEVER_OK = 0, LEVER_OUT_OF_REACH = 1, LEVER_SINGULAR = 2, LEVER_NOT_KNOWN = 4 };
enum { LEVER_ACTUATOR_LEVER_CRANK = 0 };
enum { LEVER_JOINT_LEVER_LEVER = 0 };
/* Actuators: lever_crank [rad]; joints: lever_lever [rad]. */
typedef struct { float position[1], velocity[1], effort[1]; } lever_side;
typedef lever_side lever_actuators;
typedef lever_side lever_joints;

/* A pose: positions of the actuators [0] and joints [1], their rates by each input, and the inputs'
   efforts against the loads. */
typedef struct { float position[2][1], rate[2][1][1], load[1]; } lever_point;

/* The state between calls, which lever_begin initializes: the last poses and inputs by measured
   actuators [0] and by commanded joints [1], which of them is newer, and whether there is one; what
   is held: the actuators [0] where they were last commanded or measured, whichever is newer, and the
   joints [1] where they were last measured. NaN was never there. */
typedef struct {
    lever_point point[2];
    float input[2][1];
    int newer, is_known;
    lever_side held[2];
} lever_memory;

/* The scene's names. */
static inline const char *lever_name(int side, int i)
{
    static const char *const name[2][1] = { { "lever_crank" }, { "lever_lever" } };
    return name[side][i];
}

/* Place it at inputs, each in rad or in its size; 0 if it cannot be assembled. */
static inline int lever_at(const float *q, int is_rated, lever_point *p)
{
    const float k2 = 0.02f;
    const float k3 = 0.04f;
    const float k12 = 0.025f;
    const float k13 = 0.000625f;
    const float k16 = 0.0036f;
    const float k24 = 1.0f;
    const float k37 = (-0.025f);
    const float k38 = 0.09f;
    const float x0 = q[0];
    const float v5 = (0.5f * x0);
    const float v8 = cosf(v5);
    const float v17 = (v8 * v8);
    const float v19 = (k13 + (k16 * v17));
    const float v28 = lever_gated(v19, ((v17 + k24) - 7.888609e-31f), 0.0f);
    p->position[0][0] = x0;
    p->position[1][0] = atan2f((-lever_gated((-((k3 * sinf(v5)) * v8)), v28, 0.0f)), lever_gated((k12 + (k3 * v17)), v28, 0.0f));
    if (!isfinite(p->position[0][0] + p->position[1][0]))
        return 0;
    if (!is_rated)
        return 1;
    p->rate[0][0][0] = lever_gated(1.0f, fabsf(x0), 0.0f);
    p->rate[1][0][0] = (((k2 * (k37 + (k38 * v17))) / v19) + 0.0f);
    p->load[0] = 0.0f;
    return 1;
}

/* Place it at inputs, each in rad or in its size; 0 if it cannot be assembled. */
static inline int lever_at_angle_lever(const float *q, int is_rated, lever_point *p)
{
    const float k1 = 0.02f;
    const float k2 = 0.04f;
    const float k12 = 0.025f;
    const float k13 = 0.000625f;
    const float k16 = 0.0036f;
    const float k24 = 1.0f;
    const float k35 = (-0.025f);
    const float k36 = 0.09f;
    const float x0 = q[0];
    const float v5 = (0.5f * x0);
    const float v8 = cosf(v5);
    const float v17 = (v8 * v8);
    const float v19 = (k13 + (k16 * v17));
    const float v28 = lever_gated(v19, ((v17 + k24) - 7.888609e-31f), 0.0f);
    p->position[1][0] = atan2f((-lever_gated((-((k2 * sinf(v5)) * v8)), v28, 0.0f)), lever_gated((k12 + (k2 * v17)), v28, 0.0f));
    if (!isfinite(p->position[1][0]))
        return 0;
    if (!is_rated)
        return 1;
    p->rate[1][0][0] = (((k1 * (k35 + (k36 * v17))) / v19) + 0.0f);
    p->load[0] = 0.0f;
    return 1;
}

/* One over the size of a position; or half the turn after which it is the same again, or 0. */
static inline float lever_scale(int side, int i, int is_turn)
{
    static const float scale[3][1][2] = { { { 1.0f, 0.0f } }, { { 1.0f, 3.1415927f } }, { { 1.0f, 3.1415927f } } };
    return scale[side][i][is_turn];
}

/* Gaps from a pose to positions, the shorter way round; returns the largest, in sizes. */
static inline float lever_gap(const float to[1], const lever_point *p, int side, float gap[1])
{
    float most = 0;
    int i;
    for (i = 0; i < 1; i++) {
        const float half = lever_scale(side, i, 1);
        gap[i] = to[i] - p->position[side > 0][i];
        if (half > 0 && fabsf(gap[i]) > half)
            gap[i] -= 2 * half * floorf(0.5f * gap[i] / half + 0.5f);
        most = fmaxf(most, fabsf(gap[i]) * lever_scale(side, i, 0));
    }
    return most;
}

/* Solve rate x = b, or transposed; returns the determinant's sign, 0 where that is singular. */
static inline int lever_solved(const lever_point *p, int side, int transposed, float least,
    const float b[1], float x[1])
{
    float a[1][1 + 1], most = 1, t;
    int i, j, k, best, sign = 1;
    for (i = 0; i < 1; i++) {
        for (j = 0; j < 1; j++) {
            a[i][j] = transposed ? p->rate[side > 0][j][i] * lever_scale(side, j, 0)
                : p->rate[side > 0][i][j] * lever_scale(side, i, 0);
            if (!isfinite(a[i][j]))
                return 0;
            most = fmaxf(most, fabsf(a[i][j]));
        }
        a[i][1] = transposed ? b[i] : b[i] * lever_scale(side, i, 0);
    }
    for (k = 0; k < 1; k++) {
        for (best = k, i = k + 1; i < 1; i++)
            best = fabsf(a[i][k]) > fabsf(a[best][k]) ? i : best;
        if (!(fabsf(a[best][k]) > least * most))
            return 0;
        for (j = k; j <= 1; j++) {
            t = a[k][j];
            a[k][j] = a[best][j];
            a[best][j] = t;
        }
        sign = (best == k) == (a[k][k] > 0) ? sign : -sign;
        for (i = k + 1; i < 1; i++)
            for (t = a[i][k] / a[k][k], j = k; j <= 1; j++)
                a[i][j] -= t * a[k][j];
    }
    for (i = 1 - 1; i >= 0; i--) {
        for (x[i] = a[i][1], j = i + 1; j < 1; j++)
            x[i] -= a[i][j] * x[j];
        x[i] /= a[i][i];
    }
    for (i = 0; i < 1; i++) {
        x[i] *= transposed ? lever_scale(side, i, 0) : 1;
        if (!isfinite(x[i]))
            return 0;
    }
    return sign;
}

/* Whether a pose at inputs q is at positions, but for rounding: of the inputs, where it moves fast. */
static inline int lever_near(const lever_point *p, int side, const float q[1], float left)
{
    float steepest = 1;
    int i, j;
    for (i = 0; i < 1; i++)
        for (j = 0; j < 1; j++)
            steepest = fmaxf(steepest, fabsf(p->rate[side > 0][i][j]) * lever_scale(side, i, 0)
                * fmaxf(1, fabsf(q[j])));
    /* At an end of the reach the rate is infinite, yet rounding is not. */
    return left <= 4e-06f * fminf(steepest, 1000.0f);
}

/* Newton's method from inputs q to positions: each step comes nearer, and stays on its side of
   singular poses. Returns 0, with any q, if it does not converge; -1 if it is strict and q misses
   by so much that it belongs to another assembly. */
static inline int lever_reached(int side, int (*at)(const float *, int, lever_point *),
    int steps, int is_strict, const float position[1], float q[1], lever_point *p)
{
    lever_point next;
    float gap[1], x[1] = { 0 }, y[1] = { 0 }, to[1], share = 1, longest, left, now;
    int i, sign, other = 0;
    if (!at(q, side < 2, p))
        return 0;
    left = lever_gap(position, p, side, gap);
    if (left <= 2e-06f)
        return 1;
    if (is_strict && left > 0.01f)
        return -1;
    if (side > 1 && !at(q, 1, p))
        return 0;
    sign = lever_solved(p, side, 0, 1e-05f, gap, x);
    while (--steps > 0 && sign && left > 2e-06f && share > 0.00024414062f) {
        for (longest = 1, i = 0; i < 1; i++)
            longest = fmaxf(longest, fabsf(x[i]) / 0.5f);
        for (i = 0; i < 1; i++)
            to[i] = q[i] + share / longest * x[i];
        now = at(to, 1, &next) ? lever_gap(position, &next, side, gap) : left;
        if (now < left)
            other = lever_solved(&next, side, 0, 1e-05f, gap, y);
        if (now < left && (other == sign || now <= 4e-06f)) {
            *p = next;
            left = now;
            sign = other;
            share = 1;
            for (i = 0; i < 1; i++) {
                q[i] = to[i];
                x[i] = y[i];
            }
        } else
            share = left <= 4e-06f ? 0 : 0.5f * share;
    }
    return lever_near(p, side, q, left);
}

/* Inputs x plus whole turns, and those that bring them nearest to others; returns how far they are.
   What is commanded has to be in the sweeps: infinitely far if it is not. What is measured may be
   outside, which counts as further. */
static inline float lever_turned(int side, const float turn[1][2], const float whole[1],
    const float x[1], const float near[1], float q[1])
{
    static const float end[1][2] = { { (-INFINITY), (INFINITY) } };
    float sum = 0, to;
    int i;
    for (i = 0; i < 1; i++) {
        to = near[i];
        if (side == 1)
            to = to < end[i][0] ? end[i][0] : to > end[i][1] ? end[i][1] : to;
        q[i] = x[i] + whole[i];
        if (turn[i][0] > 0)
            q[i] += turn[i][0] * floorf((to - q[i]) * turn[i][1] + 0.5f);
        if (side == 1 && q[i] < end[i][0])
            q[i] += turn[i][0];
        else if (side == 1 && q[i] > end[i][1])
            q[i] -= turn[i][0];
        sum += fabsf(q[i] - near[i]);
        if (side < 2 && (q[i] < end[i][0] || q[i] > end[i][1]))
            sum += side ? (INFINITY) : 10.0f * fabsf(q[i] - end[i][q[i] > end[i][1]]);
    }
    return sum;
}

/* From positions to the inputs nearest to q. By its gear, 4 poses at most. */
static inline int lever_from_actuators(const float position[1], float q[1], lever_point *p)
{
    /* The inputs' turns, and one over them; 0 where there is none. */
    static const float turn[1][2] = { { 0.0f, 0.0f } };
    /* Whole turns that a position counts are taken away, so that they cost no digits. */
    float whole[1] = { 0 }, to[1], near[1];
    float start[1][1], away[1], far;
    lever_point found;
    int i, k, next, ended;
    for (i = 0; i < 1; i++) {
        to[i] = position[i];
        near[i] = q[i];
    }
    near[0] = position[0];
    whole[0] = 6.2831855f * floorf(near[0] * 0.15915494f + 0.5f);
    to[0] -= whole[0];
    for (k = 0; k < 1; k++) {
        start[k][0] = near[0] - whole[0];
        away[k] = lever_turned(0, turn, whole, start[k], near, q);
    }
    for (;;) {
        for (next = 0, k = 1; k < 1; k++)
            next = away[k] < away[next] || !isfinite(away[next]) ? k : next;
        if (!isfinite(away[next]))
            return 0;
        far = away[next];
        ended = lever_reached(0, lever_at, 4, 0, to, start[next], &found);
        away[next] = ended < 0 ? far + 1000000.0f : (INFINITY);
        if (ended > 0 && isfinite(lever_turned(0, turn, whole, start[next], near, q))) {
            *p = found;
            p->position[0][0] += q[0] - start[next][0];
            return 1;
        }
    }
}

/* The inputs in each assembly mode, NAN where there is none. */
static inline void lever_modes_joints(const float position[1],
    float start[2][1])
{
    const float k26 = 0.70710677f;
    const float k33 = 0.70710677f;
    const float x0 = position[0];
    const float v3 = (0.5f * x0);
    const float v4 = sinf(v3);
    const float v6 = cosf(v3);
    const float v9 = (((2.0f * v4) * v6) * 0.081f);
    const float v15 = ((1.0f - (2.0f * (v4 * v4))) * 0.081f);
    const float v18 = sqrtf(((v9 * v9) + (v15 * v15)));
    const float v19 = (v9 / v18);
    const float v35 = ((-(v4 * k26)) + (v6 * k33));
    const float v43 = ((v6 * k26) + (v4 * k33));
    const float v48 = (lever_root(((-0.025f) + (0.09f * (v35 * v35))), 5.7731595e-17f) * lever_root(((-0.025f) + (0.09f * (v43 * v43))), 5.7731595e-17f));
    const float v49 = (v19 * v48);
    const float v51 = (v15 / v18);
    const float v53 = (v19 * 0.045f);
    const float v54 = (v51 * v53);
    const float v58 = (-(v19 * v53));
    const float v59 = (v51 * v48);
    start[0][0] = atan2f((-((-v49) - v54)), (v58 + v59));
    start[1][0] = atan2f((-(v49 - v54)), (v58 - v59));
}
/* From positions to the inputs nearest to q. In closed form, 18 poses at most. */
static inline int lever_from_joints(const float position[1], float q[1], lever_point *p)
{
    /* The inputs' turns, and one over them; 0 where there is none. */
    static const float turn[1][2] = { { 6.2831855f, 0.15915494f } };
    /* Whole turns that a position counts are taken away, so that they cost no digits. */
    float whole[1] = { 0 }, to[1], near[1];
    float start[3][1], away[3], far;
    lever_point found;
    int i, k, next, ended;
    for (i = 0; i < 1; i++) {
        to[i] = position[i];
        near[i] = q[i];
    }
    lever_modes_joints(to, start);
    for (i = 0; i < 1; i++) start[2][i] = q[i] - turn[i][0] * floorf(q[i] * turn[i][1] + 0.5f);
    for (k = 0; k < 3; k++) {
        away[k] = lever_turned(1, turn, whole, start[k], near, q);
    }
    away[2] = 1000000.0f;
    for (;;) {
        for (next = 0, k = 1; k < 3; k++)
            next = away[k] < away[next] || !isfinite(away[next]) ? k : next;
        if (!isfinite(away[next]))
            return 0;
        far = away[next];
        ended = lever_reached(1, lever_at, 4, far < 1000000.0f, to, start[next], &found);
        away[next] = ended < 0 ? far + 1000000.0f : (INFINITY);
        if (ended > 0 && isfinite(lever_turned(1, turn, whole, start[next], near, q))) {
            *p = found;
            p->position[0][0] += q[0] - start[next][0];
            return 1;
        }
    }
}

/* The inputs in each assembly mode, NAN where there is none. */
static inline void lever_modes_angle_lever(const float position[1],
    float start[2][1])
{
    const float k26 = 0.70710677f;
    const float k33 = 0.70710677f;
    const float x0 = position[0];
    const float v3 = (0.5f * x0);
    const float v4 = sinf(v3);
    const float v6 = cosf(v3);
    const float v9 = (((2.0f * v4) * v6) * 0.081f);
    const float v15 = ((1.0f - (2.0f * (v4 * v4))) * 0.081f);
    const float v18 = sqrtf(((v9 * v9) + (v15 * v15)));
    const float v19 = (v9 / v18);
    const float v35 = ((-(v4 * k26)) + (v6 * k33));
    const float v43 = ((v6 * k26) + (v4 * k33));
    const float v48 = (lever_root(((-0.025f) + (0.09f * (v35 * v35))), 5.7731595e-17f) * lever_root(((-0.025f) + (0.09f * (v43 * v43))), 5.7731595e-17f));
    const float v49 = (v19 * v48);
    const float v51 = (v15 / v18);
    const float v53 = (v19 * 0.045f);
    const float v54 = (v51 * v53);
    const float v58 = (-(v19 * v53));
    const float v59 = (v51 * v48);
    start[0][0] = atan2f((-((-v49) - v54)), (v58 + v59));
    start[1][0] = atan2f((-(v49 - v54)), (v58 - v59));
}
/* From positions to the inputs nearest to q. In closed form, 18 poses at most. */
static inline int lever_from_angle_lever(const float position[1], float q[1], lever_point *p)
{
    /* The inputs' turns, and one over them; 0 where there is none. */
    static const float turn[1][2] = { { 6.2831855f, 0.15915494f } };
    /* Whole turns that a position counts are taken away, so that they cost no digits. */
    float whole[1] = { 0 }, to[1], near[1];
    float start[3][1], away[3], far;
    lever_point found;
    int i, k, next, ended;
    for (i = 0; i < 1; i++) {
        to[i] = position[i];
        near[i] = q[i];
    }
    lever_modes_angle_lever(to, start);
    for (i = 0; i < 1; i++) start[2][i] = q[i] - turn[i][0] * floorf(q[i] * turn[i][1] + 0.5f);
    for (k = 0; k < 3; k++) {
        away[k] = lever_turned(2, turn, whole, start[k], near, q);
    }
    away[2] = 1000000.0f;
    for (;;) {
        for (next = 0, k = 1; k < 3; k++)
            next = away[k] < away[next] || !isfinite(away[next]) ? k : next;
        if (!isfinite(away[next]))
            return 0;
        far = away[next];
        ended = lever_reached(2, lever_at_angle_lever, 4, far < 1000000.0f, to, start[next], &found);
        away[next] = ended < 0 ? far + 1000000.0f : (INFINITY);
        if (ended > 0 && isfinite(lever_turned(2, turn, whole, start[next], near, q))) {
            *p = found;
            return 1;
        }
    }
}

/* Sample i of the inputs, all over their ranges; 0 is where they start. */
static inline void lever_sample(long i, float q[1])
{
    static const float range[1][4] = { { 0.0f, (-3.1415927f), 6.2831855f, 0.41421357f } };
    int k;
    for (k = 0; k < 1; k++) {
        const float x = range[k][3] * (float)i;
        q[k] = i ? range[k][1] + range[k][2] * (x - floorf(x)) : range[k][0];
    }
}

/* Initialize the memory and find a first pose; returns 0 if there is none. */
static inline int lever_begin(lever_memory *m)
{
    static const lever_side none = { { 0 }, { 0 }, { 0 } };
    int i;
    m->newer = 1;
    m->is_known = 0;
    m->held[0] = m->held[1] = none;
    for (i = 0; i < 1; i++)
        m->held[0].position[i] = m->held[1].position[i] = (float)NAN;
    for (i = 0; i < 4096; i++) {
        lever_sample(i, m->input[1]);
        if (lever_at(m->input[1], 1, &m->point[1]))
            return 1;
    }
    return 0;
}

static inline int lever_transmit(lever_memory *m, int side, const lever_side *from, lever_side *to)
{
    const int other = 1 - side, before = m->newer, was_known = m->is_known;
    static const float none[1][2] = { { 0 } };
    lever_side *held = &m->held[other];
    lever_point found = m->point[before];
    const lever_point *at;
    float q[1], x[1], y[1] = { 0 };
    int i, j, status = LEVER_OK, all;
    for (i = 0; i < 1; i++) {
        q[i] = m->input[before][i];
        status = isfinite(from->position[i]) ? status : LEVER_NOT_KNOWN;
        /* Where an actuator is measured is newer than its command, within the reach or not. */
        if (!side && isfinite(from->position[i]))
            m->held[0].position[i] = from->position[i];
    }
    /* Where it is already needs no search; but a command has to be in the sweep. */
    if (status == LEVER_OK && !(was_known && lever_gap(from->position, &found, side, x) <= 2e-06f
            && isfinite(lever_turned(side, none, y, q, q, x)))
            && !(side ? lever_from_joints(from->position, q, &found)
            : lever_from_actuators(from->position, q, &found)))
        status = LEVER_OUT_OF_REACH;
    for (i = 0; status == LEVER_OK && i < 1; i++)
        status = isfinite(found.position[other][i]) ? LEVER_OK : LEVER_OUT_OF_REACH;
    if (status == LEVER_OK) {
        m->newer = side;
        m->is_known = 1;
        m->point[side] = found;
        for (i = 0; i < 1; i++) {
            m->input[side][i] = q[i];
            held->position[i] = found.position[other][i];
        }
    }
    /* A position that is not commanded is not written. */
    for (i = 0; i < 1; i++)
        if (!(side && status == LEVER_NOT_KNOWN) && isfinite(held->position[i]))
            to->position[i] = held->position[i];
    all = status;

    /* Velocities at the newest pose; a held position has velocity 0. */
    at = &m->point[m->newer];
    if (status == LEVER_NOT_KNOWN && m->is_known)
        status = LEVER_OK;
    for (i = 0; i < 1; i++)
        status |= isfinite(from->velocity[i]) ? LEVER_OK : LEVER_NOT_KNOWN;
    if (status == LEVER_OK && !lever_solved(at, side, 0, 0.001f, from->velocity, x))
        status = LEVER_SINGULAR;
    for (i = 0; status == LEVER_OK && i < 1; i++)
        for (j = 0; j < 1; j++)
            y[i] += at->rate[other][i][j] * x[j];
    for (i = 0; i < 1; i++)
        status |= isfinite(y[i]) ? LEVER_OK : LEVER_SINGULAR;
    for (i = 0; i < 1; i++)
        if (!(side && status & LEVER_NOT_KNOWN))
            to->velocity[i] = status == LEVER_OK ? y[i] : 0;
    all |= status;

    /* Efforts where the actuators are: their power is that of the joints, less that of the loads. */
    at = &m->point[side && was_known ? before : m->newer];
    status = m->is_known ? LEVER_OK : LEVER_NOT_KNOWN;
    for (i = 0; i < 1; i++)
        status = isfinite(from->effort[i]) ? status : LEVER_NOT_KNOWN;
    for (i = 0; status == LEVER_OK && i < 1; i++)
        for (x[i] = side ? at->load[i] : -at->load[i], j = 0; j < 1; j++)
            x[i] += at->rate[side][j][i] * from->effort[j];
    if (status == LEVER_OK && !lever_solved(at, other, 1, 0.001f, x, y))
        status = LEVER_SINGULAR;
    for (i = 0; i < 1; i++) {
        /* What was commanded before a pause is not held after it. */
        if (status != LEVER_SINGULAR && (side || status == LEVER_OK))
            held->effort[i] = status == LEVER_OK ? y[i] : 0;
        if (!(side && status == LEVER_NOT_KNOWN))
            to->effort[i] = held->effort[i];
    }
    return all | status;
}

/* From the actuators' positions, velocities and efforts to the joints'. Returns a status: where it
   is not OK, positions and efforts are the last measured ones, and velocities 0. */
static inline int lever_actuators_to_joints(lever_memory *m, const lever_actuators *from, lever_joints *to)
{
    return lever_transmit(m, 0, from, to);
}

/* The same from the joints to the actuators, to the inputs nearest to the last ones. Out of reach
   the actuators are commanded to where they are: what was last commanded or measured, whichever is
   newer. What is not commanded, NaN, is not written. */
static inline int lever_joints_to_actuators(lever_memory *m, const lever_joints *from, lever_actuators *to)
{
    return lever_transmit(m, 1, from, to);
}

/* The crank for lever [rad], nearest to `near`, whole turns included. Returns 0, and
   leaves crank alone, where there is none. */
static inline int lever_crank_for_angle_lever(float value, float near, float *crank)
{
    float q[1];
    lever_point p;
    q[0] = near;
    if (!(isfinite(value)) || !lever_from_angle_lever(&value, q, &p))
        return 0;
    *crank = q[0];
    return 1;
}

#endif /* LEVER_LINKAGE_H */

