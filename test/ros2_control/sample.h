/* SPDX-FileCopyrightText: 2026 linkage_ros contributors */
/* SPDX-License-Identifier: Apache-2.0 */

/* Sample i of the inputs, all over their ranges, for programs that include the C of a linkage. */
static inline void sample(int inputs, const double (*range)[2], long i, lkr_real *q)
{
    int k;
    for (k = 0; k < inputs; k++) {
        /* Multiples of irrational numbers, without their whole parts. */
        const double x = (double)i * sqrt(1.0 + (k + 1.0) * (k + 1.0));
        q[k] = (lkr_real)(range[k][0] + (range[k][1] - range[k][0]) * (x - floor(x)));
    }
}
