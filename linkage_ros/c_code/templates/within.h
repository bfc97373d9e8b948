/* Whether an input is in its reach, or beyond an end by rounding; `is_moved` brings it inside. */
static inline int @name@_within(@number@ q[1], int is_moved)
{
    /* Middles of arcs, and half their lengths. */
    static const @number@ arc[@arc_count@][2] = { @arcs@ };
    int i;
    for (i = 0; i < @arc_count@; i++) {
        @number@ gap = q[0] - arc[i][0], over;
        gap -= @turn@ * floor@f@(gap * @by_turn@ + @half@);
        over = fabs@f@(gap) - arc[i][1];
        if (over <= @slack@) {
            q[0] -= is_moved && over > 0 ? copysign@f@(over, gap) : 0;
            return 1;
        }
    }
    return 0;
}

