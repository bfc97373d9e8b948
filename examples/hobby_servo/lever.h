/*
 * lever: slotted_lever, written by linkage_ros.
 * Lengths [m]: a = 0.02, b = 0.045, e = 0.
 * Input: crank [rad]. Angles [rad] count counterclockwise.
 * C99 without heap; compile without -ffast-math, which drops the checks.
 * float: joints are off by up to 1e-07 of the longest bar at 2001 poses over the reach, without its outermost hundredth.
 */
#ifndef LEVER_LINKAGE_H
#define LEVER_LINKAGE_H

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
    const float k31 = 0.025f;
    const float k43 = 0.081f;
    const float k62 = 0.000625f;
    const float k65 = 0.0036f;
    const float k73 = 0.0f;
    const float x0 = crank;
    const float v14 = (0.5f * x0);
    const float v15 = sinf(v14);
    const float v17 = cosf(v14);
    const float v29 = (-((k26 * v15) * v17));
    const float v32 = (v17 * v17);
    const float v34 = (k31 + (k26 * v32));
    const float v37 = sqrtf(((v29 * v29) + (v34 * v34)));
    const float v38 = (v29 / v37);
    const float v45 = (v34 / v37);
    p->O_x = 0.0f;
    p->O_y = 0.0f;
    p->Q_x = 0.0f;
    p->Q_y = k10;
    p->A_x = (-(((2.0f * v15) * v17) * k19));
    p->A_y = ((1.0f - (2.0f * (v15 * v15))) * k19);
    p->L_x = (v38 * k43);
    p->L_y = (k7 + (v45 * k43));
    p->angle_crank = x0;
    p->angle_lever = atan2f((-v38), v45);
    p->slide_slide = lever_root((k62 + (k65 * v32)), k73);
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
    const float k50 = 0.081f;
    const float k74 = 0.000625f;
    const float k81 = 0.0f;
    const float x0 = crank;
    const float v5 = (0.5f * x0);
    const float v6 = sinf(v5);
    const float v14 = cosf(v5);
    const float v21 = (v14 * v14);
    const float v30 = (k29 * v21);
    const float v33 = (((k10 * (k19 + (k20 * v21))) / (k26 + v30)) + 0.0f);
    const float v36 = (k25 + (k34 * v21));
    const float v39 = (-((k34 * v6) * v14));
    const float v43 = sqrtf(((v39 * v39) + (v36 * v36)));
    by_crank->O_x = 0.0f;
    by_crank->O_y = 0.0f;
    by_crank->Q_x = 0.0f;
    by_crank->Q_y = 0.0f;
    by_crank->A_x = (-((1.0f - (2.0f * (v6 * v6))) * k10));
    by_crank->A_y = (-(((2.0f * v6) * v14) * k10));
    by_crank->L_x = (-((v33 * (v36 / v43)) * k50));
    by_crank->L_y = ((v33 * (v39 / v43)) * k50);
    by_crank->angle_crank = lever_gated(1.0f, fabsf(x0), 0.0f);
    by_crank->angle_lever = v33;
    by_crank->slide_slide = (-(((((v6 * 0.5f) * v14) * 2.0f) * k29) / (2.0f * lever_root((k74 + v30), k81))));
}

/* Whether it can be assembled: [-3.14159, 3.14159] rad. */
static inline int lever_reaches(float crank)
{
    return isfinite(crank);
}

/* lever and its rate. */
static inline void lever_angle_lever_of(float crank, float *value, float *rate)
{
    const float k1 = 0.02f;
    const float k2 = 0.04f;
    const float k13 = 0.025f;
    const float k24 = (-0.025f);
    const float k25 = 0.09f;
    const float k29 = 0.000625f;
    const float k32 = 0.0036f;
    const float x0 = crank;
    const float v5 = (0.5f * x0);
    const float v8 = cosf(v5);
    const float v10 = (-((k2 * sinf(v5)) * v8));
    const float v14 = (v8 * v8);
    const float v16 = (k13 + (k2 * v14));
    const float v19 = sqrtf(((v10 * v10) + (v16 * v16)));
    *value = atan2f((-(v10 / v19)), (v16 / v19));
    *rate = (((k1 * (k24 + (k25 * v14))) / (k29 + (k32 * v14))) + 0.0f);
}

/* The crank for lever = value [rad], the one nearest to `near`, whole turns included.
   Returns 0, and leaves *crank alone, where there is none. */
static inline int lever_crank_for_angle_lever(float value, float near, float *crank)
{
    /* Where lever rises or falls all along: crank and lever at both ends of each piece. */
    static const float piece[3][4] = {
        {(-3.1415927f), (-2.0313504f), 2.5729962e-16f, (-0.460554f)},
        {(-2.0313504f), 2.0313504f, (-0.460554f), 0.460554f},
        {2.0313504f, 3.1415927f, 0.460554f, (-2.5729962e-16f)}
    };
    float best = (float)INFINITY;
    int i, step;
    for (i = 0; i < 3; i++) {
        const float *p = piece[i];
        float least = p[2] < p[3] ? p[2] : p[3], most = p[2] < p[3] ? p[3] : p[2];
        float low = p[0], high = p[1], x = 0.5f * (low + high), target = value;
        target += 6.2831855f * ceilf((least - 1.1984225e-05f - target) / 6.2831855f);
        if (!(target >= least - 1.1984225e-05f && target <= most + 1.1984225e-05f))
            continue;
        for (step = 0; step < 60; step++) {
            float now, rate, next, gap;
            lever_angle_lever_of(x, &now, &rate);
            gap = now - target - 6.2831855f * floorf((now - target) / 6.2831855f + 0.5f);
            if ((gap < 0.0f) == (p[2] < p[3]))
                low = x;
            else
                high = x;
            next = x - gap / rate;
            if (!(next > low && next < high))
                next = 0.5f * (low + high);
            if (next == x)
                break;
            x = next;
        }
        x += 6.2831855f * floorf((near - x) / 6.2831855f + 0.5f);
        if (fabsf(x - near) < best) {
            best = fabsf(x - near);
            *crank = x;
        }
    }
    return best < (float)INFINITY;
}

#endif /* LEVER_LINKAGE_H */

