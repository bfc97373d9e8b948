/*
 * SPDX-FileCopyrightText: 2026 linkage_ros contributors
 * SPDX-License-Identifier: Apache-2.0
 *
 * The four linkages in C: what a compiler makes of the stable formulas when nothing is in its
 * way. Every function takes the dimensions in the catalogue's order, n crank angles [rad] and room
 * for n rows of points (x, y, x, y, ...), and writes NaN where the linkage cannot be assembled.
 * Sines are taken block by block before the rest, which the compiler can then do in vectors.
 */

#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <math.h>

#ifdef VECTOR_SINE
/* The C library has these for several numbers at once, right to 4 ulp, but only offers them where
   -ffast-math gives up NaN as well. */
__attribute__((simd("notinbranch"))) double sin(double);
__attribute__((simd("notinbranch"))) double cos(double);
#endif

typedef struct { double x, y; } point;

/* A radicand that is negative only by rounding counts as reached. */
#define GRAZE (8 * 0x1p-53)

static inline double root(double value, double scale)
{
  return value >= 0 ? sqrt(value) : value > -GRAZE * scale ? 0.0 : NAN;
}

static inline point turned(point p, point q, point k)
{
  double x = q.x - p.x, y = q.y - p.y;
  return (point){p.x + x * k.x - y * k.y, p.y + x * k.y + y * k.x};
}

/* The factor that takes an arm of square d2 to the meeting point of two circles on its ends. */
static inline point factor(double d2, double p, double q, double side)
{
  double d = sqrt(d2), far = p + q, near = fabs(p - q), half = 0.5 / d2;
  double square = (far - d) * (far + d) * (d - near) * (d + near);
  return (point){0.5 + (p - q) * far * half, side * root(square, 4 * far * far * far * d) * half};
}

static inline point dyad(point p, point q, double rp, double rq, double side)
{
  double x = q.x - p.x, y = q.y - p.y;
  return turned(p, q, factor(x * x + y * y, rp, rq, side));
}

static void water_drop_block(const double *dims, const double *restrict sine_half,
  const double *restrict cosine_half, long n, double *restrict out)
{
  double a = dims[0], c = 2 * a, k = 3;
  double tip = (c + a) * ((k - 1) * c - (k + 1) * a);
  for (long i = 0; i < n; ++i, out += 6) {
    double s = sine_half[i], h = cosine_half[i];
    double sine = 2 * s * h;
    double wx = (c - a) + 2 * a * h * h, wy = a * sine;
    double square = (c - a) * (c - a) + 4 * a * c * h * h;
    double mirror = -2 * a * c * sine / square;
    double ay = a * (h - s) * (h + s), by = mirror * wy;
    out[0] = -a * sine;
    out[1] = ay;
    out[2] = mirror * wx;
    out[3] = by;
    out[4] = a * sine * (tip + 4 * a * c * s * s) / square;
    out[5] = (1 + k) * ay - k * by;
  }
}

static void jansen_block(const double *dims, const double *restrict sine,
  const double *restrict cosine, long n, double *restrict out)
{
  double a = dims[0], b = dims[1], c = dims[2], d = dims[3], e = dims[4], f = dims[5],
    g = dims[6], h = dims[7], i = dims[8], j = dims[9], k = dims[10], l = dims[11], m = dims[12];
  point B = {-a, -l}, knee = factor(b * b, d, e, 1), foot = factor(g * g, i, h, 1);
  for (long at = 0; at < n; ++at) {
    point A = {m * cosine[at], m * sine[at]};
    point C = dyad(B, A, b, j, 1), D = turned(B, C, knee);
    point E = dyad(B, A, c, k, -1);
    point F = dyad(E, D, g, f, 1), G = turned(E, F, foot);
    point *row = (point *)(out + 12 * at);
    row[0] = A;
    row[1] = C;
    row[2] = D;
    row[3] = E;
    row[4] = F;
    row[5] = G;
  }
}

static void peaucellier_block(const double *dims, const double *restrict sine_half,
  const double *restrict cosine_half, long n, double *restrict out)
{
  double r = dims[0], a = dims[1], b = dims[2];
  double power = (a - b) * (a + b), low = fabs(a - b), high = a + b;
  for (long i = 0; i < n; ++i, out += 8) {
    double s = sine_half[i], h = cosine_half[i];
    s = h < 0 ? -s : s;
    h = fabs(h);
    double rho = 2 * r * h, outer, inner;
    if (h > 0.5) {
      double sag = 2 * r * s * s / (1 + h);
      outer = (high - 2 * r) + sag;
      inner = (2 * r - low) - sag;
    } else {
      outer = high - rho;
      inner = rho - low;
    }
    double q = 0.5 * (rho + power / rho);
    double eta = root(outer * (high + rho) * inner * (rho + low), 4 * high * high * high * r)
      / (2 * rho);
    double reached = eta * 0;
    out[0] = r * (h - s) * (h + s);
    out[1] = 2 * r * s * h;
    out[2] = q * h + eta * s - r;
    out[3] = q * s - eta * h;
    out[4] = power / (2 * r) - r + reached;
    out[5] = power / (2 * r) * (s / h) + reached;
    out[6] = q * h - eta * s - r;
    out[7] = q * s + eta * h;
  }
}

static void slotted_lever_block(const double *dims, const double *restrict sine_half,
  const double *restrict cosine_half, long n, double *restrict out)
{
  double a = dims[0], b = dims[1], e = dims[2], length = fmax(9 * b / 5, a + b);
  double near = (fabs(b - a) - fabs(e)) * (fabs(b - a) + fabs(e));
  double far = (a + b - fabs(e)) * (a + b + fabs(e));
  for (long i = 0; i < n; ++i, out += 4) {
    double s = sine_half[i], h = cosine_half[i];
    double sine = 2 * s * h, wx = (b - a) + 2 * a * h * h, wy = a * sine;
    double square = s * s < 0.5 ? far - 4 * a * b * s * s : near + 4 * a * b * h * h;
    double slide = root(square, (a + b) * (a + b));
    double reach = length / (square + e * e);
    out[0] = -a * sine;
    out[1] = a * (h - s) * (h + s);
    out[2] = -(wy * slide - wx * e) * reach;
    out[3] = (wx * slide + wy * e) * reach - b;
  }
}

#define BLOCK 512

#ifdef VECTOR_SINE
static void turn(const double *restrict theta, double share, long n, double *restrict sine,
  double *restrict cosine)
{
  for (long i = 0; i < n; ++i)
    sine[i] = sin(share * theta[i]);
  for (long i = 0; i < n; ++i)
    cosine[i] = cos(share * theta[i]);
}
#else
static void turn(const double *restrict theta, double share, long n, double *restrict sine,
  double *restrict cosine)
{
  for (long i = 0; i < n; ++i)
    sincos(share * theta[i], sine + i, cosine + i);
}
#endif

#define BATCHED(linkage, width, share) \
  void linkage(const double *dims, const double *theta, long n, double *out) \
  { \
    double sine[BLOCK], cosine[BLOCK]; \
    for (; n > 0; n -= BLOCK, theta += BLOCK, out += BLOCK * width) { \
      long count = n < BLOCK ? n : BLOCK; \
      turn(theta, share, count, sine, cosine); \
      linkage##_block(dims, sine, cosine, count, out); \
    } \
  }

BATCHED(water_drop, 6, 0.5)
BATCHED(jansen, 12, 1.0)
BATCHED(peaucellier, 8, 0.5)
BATCHED(slotted_lever, 4, 0.5)
