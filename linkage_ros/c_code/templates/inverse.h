/* From positions to the inputs nearest to q. @how@. */
static inline int @name@_from_@tag@(@given@const @number@ position[@n@], @number@ q[@n@], @name@_point *p)
{
    @number@ start[@count@][@n@], away[@count@], far, best = @infinity@, near[@n@];
    @name@_point found;
    int i, k, tried, next;
    for (i = 0; i < @n@; i++)
        near[i] = q[i];
@starts@
    for (k = 0; k < @count@; k++)
        for (away[k] = @zero@, i = 0; i < @n@; i++)
            away[k] += fabs@f@(start[k][i] - near[i]);
    for (tried = 0; tried < @count@; tried++) {
        for (next = 0, k = 1; k < @count@; k++)
            next = away[k] < away[next] || !isfinite(away[next]) ? k : next;
        if (!isfinite(away[next]))
            break;
        away[next] = @infinity@;
        if (@name@_reached(@pass@@side@, @at@, @steps@, position, start[next], &found)@inside@) {
            for (far = @zero@, i = 0; i < @n@; i++)
                far += fabs@f@(start[next][i] - near[i]);
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
