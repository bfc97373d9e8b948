/* From positions to the inputs nearest to q. @how@, @poses@ poses at most. */
static inline int @name@_from_@tag@(@given@const @number@ position[@n@], @number@ q[@n@], @name@_point *p)
{
    /* The inputs' turns, and one over them; 0 where there is none. */
    static const @number@ turn[@n@][2] = { @turns@ };
    @number@ start[@count@][@n@], away[@count@], far, best = @infinity@, near[@n@];
    @name@_point found;
    int i, k, next, ended;
    for (i = 0; i < @n@; i++)
        start[0][i] = near[i] = q[i];
@starts@
    for (k = 0; k < @count@; k++) {
@given_inputs@
        for (i = 0; i < @n@; i++)
            start[k][i] += turn[i][0] * floor@f@((near[i] - start[k][i]) * turn[i][1] + @half@);
        away[k] = @name@_away(start[k], near);
    }
    for (;;) {
        for (next = 0, k = 1; k < @count@; k++)
            next = away[k] < away[next] || !isfinite(away[next]) ? k : next;
        if (!isfinite(away[next]))
            break;
        far = away[next];
        ended = @name@_reached(@pass@@side@, @at@, @steps@, @strict@, position, start[next], &found);
        away[next] = ended < 0 ? far + @last@ : @infinity@;
        if (ended > 0@inside@) {
            @moved@
            if (far < best) {
                *p = found;
                for (best = far, i = 0; i < @n@; i++)
                    q[i] = start[next][i];
            }
            @stop@
        }
    }
    return best < @infinity@;
}
