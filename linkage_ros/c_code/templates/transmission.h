/* Status of a call: 0, or a sum of these. OUT_OF_REACH: outside the reach or the sweep. SINGULAR: a
   velocity or an effort would be infinite. NOT_KNOWN: a value is NaN or infinite. */
enum { @N@_OK = 0, @N@_OUT_OF_REACH = 1, @N@_SINGULAR = 2, @N@_NOT_KNOWN = 4 };
@enums@
/* @about@. */
typedef struct { @number@ position[@n@], velocity[@n@], effort[@n@]; } @name@_side;
typedef @name@_side @name@_actuators;
typedef @name@_side @name@_joints;

/* A pose: positions of the actuators [0] and joints [1], their rates by each input, and the inputs'
   efforts against the loads. */
typedef struct { @number@ position[2][@n@], rate[2][@n@][@n@], load[@n@]; } @name@_point;

/* The state between calls, which @name@_begin initializes: the last poses and inputs by measured
   actuators [0] and by commanded joints [1], and the last valid values of both. */
typedef struct {
    @name@_point point[2];
    @number@ input[2][@n@];
    int is_known[2], is_held[2];
    @name@_side held[2];
} @name@_memory;

/* The scene's names. */
static inline const char *@name@_name(int side, int i)
{
    static const char *const name[2][@n@] = { { @actuator_names@ }, { @joint_names@ } };
    return name[side][i];
}

@at@
/* One over the size of a position; or half the turn after which it is the same again, or 0. */
static inline @number@ @name@_scale(int side, int i, int is_turn)
{
    static const @number@ scale[@sides@][@n@][2] = { @scales@ };
    return scale[side][i][is_turn];
}

/* Gaps from a pose to positions, the shorter way round; returns the largest, in sizes. */
static inline @number@ @name@_gap(const @number@ to[@n@], const @name@_point *p, int side, @number@ gap[@n@])
{
    @number@ most = 0;
    int i;
    for (i = 0; i < @n@; i++) {
        const @number@ half = @name@_scale(side, i, 1);
        gap[i] = to[i] - p->position[side > 0][i];
        if (half > 0 && fabs@f@(gap[i]) > half)
            gap[i] -= 2 * half * floor@f@(@half@ * gap[i] / half + @half@);
        most = fmax@f@(most, fabs@f@(gap[i]) * @name@_scale(side, i, 0));
    }
    return most;
}

/* Solve rate x = b, or transposed; returns the determinant's sign, 0 where that is singular. */
static inline int @name@_solved(const @name@_point *p, int side, int transposed, @number@ least,
    const @number@ b[@n@], @number@ x[@n@])
{
    @number@ a[@n@][@n@ + 1], most = 1, t;
    int i, j, k, best, sign = 1;
    for (i = 0; i < @n@; i++) {
        for (j = 0; j < @n@; j++) {
            a[i][j] = transposed ? p->rate[side > 0][j][i] * @name@_scale(side, j, 0)
                : p->rate[side > 0][i][j] * @name@_scale(side, i, 0);
            if (!isfinite(a[i][j]))
                return 0;
            most = fmax@f@(most, fabs@f@(a[i][j]));
        }
        a[i][@n@] = transposed ? b[i] : b[i] * @name@_scale(side, i, 0);
    }
    for (k = 0; k < @n@; k++) {
        for (best = k, i = k + 1; i < @n@; i++)
            best = fabs@f@(a[i][k]) > fabs@f@(a[best][k]) ? i : best;
        if (!(fabs@f@(a[best][k]) > least * most))
            return 0;
        for (j = k; j <= @n@; j++) {
            t = a[k][j];
            a[k][j] = a[best][j];
            a[best][j] = t;
        }
        sign = (best == k) == (a[k][k] > 0) ? sign : -sign;
        for (i = k + 1; i < @n@; i++)
            for (t = a[i][k] / a[k][k], j = k; j <= @n@; j++)
                a[i][j] -= t * a[k][j];
    }
    for (i = @n@ - 1; i >= 0; i--) {
        for (x[i] = a[i][@n@], j = i + 1; j < @n@; j++)
            x[i] -= a[i][j] * x[j];
        x[i] /= a[i][i];
    }
    for (i = 0; i < @n@; i++) {
        x[i] *= transposed ? @name@_scale(side, i, 0) : 1;
        if (!isfinite(x[i]))
            return 0;
    }
    return sign;
}

@within@
/* Newton's method from inputs q to positions: each step comes nearer, and stays on its side of
   singular poses. Returns 0, with any q, if it does not converge; -1 if it is strict and q misses
   by so much that it belongs to another assembly. */
static inline int @name@_reached(@given@int side, int (*at)(@types@const @number@ *, int, @name@_point *),
    int steps, int is_strict, const @number@ position[@n@], @number@ q[@n@], @name@_point *p)
{
    @name@_point next;
    @number@ gap[@n@], x[@n@] = { 0 }, y[@n@] = { 0 }, to[@n@], share = 1, longest, left, now;
    @number@ steepest = 1;
    int i, j, sign, other = 0;
    if (!at(@pass@q, side < 2, p)@clamped@)
        return 0;
    left = @name@_gap(position, p, side, gap);
    if (left <= @enough@)
        return 1;
    if (is_strict && left > @other@)
        return -1;
    if (side > 1 && !at(@pass@q, 1, p))
        return 0;
    sign = @name@_solved(p, side, 0, @least@, gap, x);
    while (--steps > 0 && sign && left > @enough@ && share > @finest@) {
        for (longest = 1, i = 0; i < @n@; i++)
            longest = fmax@f@(longest, fabs@f@(x[i]) / @longest@);
        for (i = 0; i < @n@; i++)
            to[i] = q[i] + share / longest * x[i];
        now = at(@pass@to, 1, &next) ? @name@_gap(position, &next, side, gap) : left;
        if (now < left)
            other = @name@_solved(&next, side, 0, @least@, gap, y);
        if (now < left && (other == sign || now <= @close@)) {
            *p = next;
            left = now;
            sign = other;
            share = 1;
            for (i = 0; i < @n@; i++) {
                q[i] = to[i];
                x[i] = y[i];
            }
        } else
            share = left <= @close@ ? 0 : @half@ * share;
    }
    for (i = 0; i < @n@; i++)
        for (j = 0; j < @n@; j++)
            steepest = fmax@f@(steepest, fabs@f@(p->rate[side > 0][i][j]) * @name@_scale(side, i, 0));
    return left <= @other@ && left <= @close@ * steepest;
}

/* How far inputs are from others. */
static inline @number@ @name@_away(const @number@ q[@n@], const @number@ near[@n@])
{
    @number@ sum = fabs@f@(q[0] - near[0]);
    int i;
    for (i = 1; i < @n@; i++)
        sum += fabs@f@(q[i] - near[i]);
    return sum;
}

/* Whether inputs are within the sweeps that are set. */
static inline int @name@_inside(const @number@ q[@n@])
{
    static const @number@ end[@n@][2] = { @ends@ };
    int i;
    for (i = 0; i < @n@; i++)
        if (!(q[i] >= end[i][0] - @slack@ && q[i] <= end[i][1] + @slack@))
            return 0;
    return 1;
}

@inverses@
/* Sample i of the inputs, all over their ranges; 0 is where they start. */
static inline void @name@_sample(long i, @number@ q[@n@])
{
    static const @number@ range[@n@][4] = { @ranges@ };
    int k;
    for (k = 0; k < @n@; k++) {
        const @number@ x = range[k][3] * (@number@)i;
        q[k] = i ? range[k][1] + range[k][2] * (x - floor@f@(x)) : range[k][0];
    }
}

/* Initialize the memory and find a first pose; returns 0 if there is none. */
static inline int @name@_begin(@given@@name@_memory *m)
{
    static const @name@_side none = { { 0 }, { 0 }, { 0 } };
    int i;
    m->is_known[0] = m->is_known[1] = m->is_held[0] = m->is_held[1] = 0;
    m->held[0] = m->held[1] = none;
    for (i = 0; i < @samples@; i++) {
        @name@_sample(i, m->input[1]);
        if (@name@_at(@pass@m->input[1], 1, &m->point[1]))
            return 1;
    }
    return 0;
}

static inline int @name@_transmit(@given@@name@_memory *m, int side, const @name@_side *from, @name@_side *to)
{
    const int other = 1 - side;
    @name@_side *held = &m->held[other];
    @name@_point found;
    const @name@_point *at;
    @number@ q[@n@], x[@n@], y[@n@] = { 0 };
    int i, j, status = @N@_OK, all;
    for (i = 0; i < @n@; i++) {
        q[i] = m->input[!m->is_known[0]][i];
        status = isfinite(from->position[i]) ? status : @N@_NOT_KNOWN;
    }
    if (status == @N@_OK && !(side ? @name@_from_joints(@pass@from->position, q, &found)
            : @name@_from_actuators(@pass@from->position, q, &found)))
        status = @N@_OUT_OF_REACH;
    /* Only a command has to be in the sweep: a measurement may be outside. */
    if (status == @N@_OK && side && !@name@_inside(q))
        status = @N@_OUT_OF_REACH;
    if (status == @N@_OK) {
        m->point[side] = found;
        for (i = 0; i < @n@; i++) {
            m->input[side][i] = q[i];
            held->position[i] = found.position[other][i];
            m->held[side].position[i] = m->is_held[side] ? m->held[side].position[i] : from->position[i];
        }
        m->is_known[side] = m->is_held[0] = m->is_held[1] = 1;
    } else if (side && status == @N@_NOT_KNOWN)
        m->is_known[1] = 0;
    all = status;

    /* Velocities at the requested pose, else at the last one; a held position has velocity 0. */
    at = &m->point[m->is_known[side] ? side : other];
    if (status == @N@_NOT_KNOWN && (m->is_known[0] || m->is_known[1]))
        status = @N@_OK;
    for (i = 0; i < @n@; i++)
        status |= isfinite(from->velocity[i]) ? @N@_OK : @N@_NOT_KNOWN;
    if (status == @N@_OK && !@name@_solved(at, side, 0, @singular@, from->velocity, x))
        status = @N@_SINGULAR;
    for (i = 0; status == @N@_OK && i < @n@; i++)
        for (j = 0; j < @n@; j++)
            y[i] += at->rate[other][i][j] * x[j];
    for (i = 0; i < @n@; i++)
        status |= isfinite(y[i]) ? @N@_OK : @N@_SINGULAR;
    for (i = 0; i < @n@; i++)
        held->velocity[i] = status == @N@_OK ? y[i] : 0;
    all |= status;

    /* Efforts at the actuators' pose: their power is that of the joints, less that of the loads. */
    at = &m->point[m->is_known[0] ? 0 : 1];
    status = m->is_known[0] || m->is_known[1] ? @N@_OK : @N@_NOT_KNOWN;
    for (i = 0; status == @N@_OK && i < @n@; i++) {
        status = isfinite(from->effort[i]) ? @N@_OK : @N@_NOT_KNOWN;
        x[i] = side ? at->load[i] : -at->load[i];
        for (j = 0; j < @n@; j++)
            x[i] += at->rate[side][j][i] * from->effort[j];
    }
    if (status == @N@_OK && !@name@_solved(at, other, 1, @singular@, x, y))
        status = @N@_SINGULAR;
    for (i = 0; i < @n@; i++) {
        held->effort[i] = status == @N@_OK ? y[i] : held->effort[i];
        to->position[i] = m->is_held[other] ? held->position[i] : to->position[i];
        to->velocity[i] = held->velocity[i];
        to->effort[i] = held->effort[i];
    }
    return all | status;
}

/* From the actuators' positions, velocities and efforts to the joints'. Returns a status: where it
   is not OK, positions and efforts are the last valid ones, and velocities 0. */
static inline int @name@_actuators_to_joints(@given@@name@_memory *m, const @name@_actuators *from, @name@_joints *to)
{
    return @name@_transmit(@pass@m, 0, from, to);
}

/* The same from the joints to the actuators, to the inputs nearest to the last ones. */
static inline int @name@_joints_to_actuators(@given@@name@_memory *m, const @name@_joints *from, @name@_actuators *to)
{
    return @name@_transmit(@pass@m, 1, from, to);
}
