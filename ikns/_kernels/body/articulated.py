"""Newton's equations of marker errors on a tree of joints, factored joint by joint.

With r = x - seen, the error of a marker at x, and each degree of freedom a twist
t = (v, w) that moves x at v + w x x (x seen from one origin for all), half the weighted
squared errors of the markers have

    gradient_j      = sum_m weight_m (v_j + w_j x x) . r
    Gauss-Newton_ij = sum_m weight_m (v_i + w_i x x) . (v_j + w_j x x)
    curvature_ij    = sum_m weight_m (w_i x (v_j + w_j x x)) . r     where i carries j

over the markers that j carries. None of these matrices is ever written down. With

    m = sum weight         g = sum weight (x - r / 2)     S = sum weight sym(x (x - r)')
    f = sum weight r       h = sum weight x x r

over the markers that j carries, the true Hessian, Gauss-Newton's plus curvature, is

    H_ij = t_i . (A t_j + c_j),      A = [[m, -[g]], [[g], trace(S) - S]],
                                     c_j = -(f x w_j, f x v_j + h x w_j) / 2

and Gauss-Newton's is the same without r in A and without c. Eliminating j from the
leaves to the root takes u u' / pivot from A, with u = A t_j + c_j and pivot = t_j . u:
the articulated-body algorithm, with weights in place of masses (Featherstone 2008,
Rigid Body Dynamics Algorithms, chapter 7). The pivots are those of Cholesky's method,
so that the matrix is positive definite if all are above zero.

Of the six degrees of freedom of a free flyer, whose step is one exponential, none
carries the other: there the curvature is the mean of both orders, and c is zero.
"""

from __future__ import annotations

from ikns._kernels.body.tree import FREE_FLYER, Tree
from ikns._kernels.compiled import borrowing, inner_borrowing
from ikns.arrays import Array, Indices

#: m, g (3), S (6: xx yy zz yz zx xy).
MOMENTS = 10
#: Entries of A: its upper triangle, row after row.
INERTIA = 21
#: What a degree of freedom's row holds: t (6), u (6), 1 / pivot.
ROW = 13


@borrowing
def slope(
    tree: Tree,
    carrier: Indices,
    axes: Array,
    weight: Array,
    x: Array,
    r: Array,
    wrench: Array,
    gradient: Array,
) -> None:
    """Write the gradient (n,), and f and h of all that a joint carries, (J, 6).

    `carrier` (M,) is the joint that moves each marker; `x` and `r` are (M, 3), `axes`
    (n, 6).
    """
    for j in range(len(wrench)):
        for k in range(6):
            wrench[j, k] = 0.0
    for m in range(len(weight)):
        w = weight[m]
        if w == 0:
            continue
        j = carrier[m]
        x0, x1, x2 = x[m, 0], x[m, 1], x[m, 2]
        r0, r1, r2 = w * r[m, 0], w * r[m, 1], w * r[m, 2]
        wrench[j, 0] += r0
        wrench[j, 1] += r1
        wrench[j, 2] += r2
        wrench[j, 3] += x1 * r2 - x2 * r1
        wrench[j, 4] += x2 * r0 - x0 * r2
        wrench[j, 5] += x0 * r1 - x1 * r0
    for j in range(len(wrench) - 1, -1, -1):
        first, parent = tree.first_v[j], tree.parent[j]
        for d in range(first, first + (6 if tree.kind[j] == FREE_FLYER else 1)):
            total = 0.0
            for k in range(6):
                total += axes[d, k] * wrench[j, k]
            gradient[d] = total
        if parent >= 0:
            for k in range(6):
                wrench[parent, k] += wrench[j, k]


@borrowing
def write_inertia(
    carrier: Indices,
    weight: Array,
    x: Array,
    r: Array,
    share: float,
    moments: Array,
    inertia: Array,
) -> None:
    """Write m, g and S, (J, 10), and A, (J, 21), of the markers on each joint.

    Errors r count by their `share`: 1 for the true Hessian, 0 for Gauss-Newton's.
    """
    for j in range(len(moments)):
        for k in range(MOMENTS):
            moments[j, k] = 0.0
    for m in range(len(weight)):
        w = weight[m]
        if w == 0:
            continue
        j, z = carrier[m], 0.5 * share * w
        x0, x1, x2 = x[m, 0], x[m, 1], x[m, 2]
        z0, z1, z2 = z * r[m, 0], z * r[m, 1], z * r[m, 2]
        y0, y1, y2 = w * x0 - z0, w * x1 - z1, w * x2 - z2
        moments[j, 0] += w
        moments[j, 1] += y0
        moments[j, 2] += y1
        moments[j, 3] += y2
        moments[j, 4] += x0 * (y0 - z0)
        moments[j, 5] += x1 * (y1 - z1)
        moments[j, 6] += x2 * (y2 - z2)
        moments[j, 7] += x1 * y2 - x2 * z1
        moments[j, 8] += x2 * y0 - x0 * z2
        moments[j, 9] += x0 * y1 - x1 * z0
    for j in range(len(moments)):
        for k in range(INERTIA):
            inertia[j, k] = 0.0
        inertia[j, 0] = inertia[j, 6] = inertia[j, 11] = moments[j, 0]
        inertia[j, 5], inertia[j, 8] = -moments[j, 2], -moments[j, 3]
        inertia[j, 4], inertia[j, 10] = moments[j, 3], moments[j, 1]
        inertia[j, 12], inertia[j, 13] = moments[j, 2], -moments[j, 1]
        inertia[j, 15] = moments[j, 5] + moments[j, 6]
        inertia[j, 18] = moments[j, 6] + moments[j, 4]
        inertia[j, 20] = moments[j, 4] + moments[j, 5]
        inertia[j, 16], inertia[j, 17] = -moments[j, 9], -moments[j, 8]
        inertia[j, 19] = -moments[j, 7]


@inner_borrowing
def diagonal(tree: Tree, axes: Array, moments: Array, scale: Array) -> None:
    """Write the diagonal (n,) of Gauss-Newton's matrix.

    `moments` are those of :func:`write_inertia` with a share of zero; afterwards those
    of all markers that a joint carries.
    """
    for j in range(len(moments) - 1, -1, -1):
        m, g0, g1, g2 = moments[j, 0], moments[j, 1], moments[j, 2], moments[j, 3]
        xx, yy, zz = moments[j, 4], moments[j, 5], moments[j, 6]
        yz, zx, xy = moments[j, 7], moments[j, 8], moments[j, 9]
        first = tree.first_v[j]
        for d in range(first, first + (6 if tree.kind[j] == FREE_FLYER else 1)):
            v0, v1, v2 = axes[d, 0], axes[d, 1], axes[d, 2]
            w0, w1, w2 = axes[d, 3], axes[d, 4], axes[d, 5]
            scale[d] = (
                m * (v0 * v0 + v1 * v1 + v2 * v2)
                + 2 * v0 * (w1 * g2 - w2 * g1)
                + 2 * v1 * (w2 * g0 - w0 * g2)
                + 2 * v2 * (w0 * g1 - w1 * g0)
                + (yy + zz) * w0 * w0
                + (zz + xx) * w1 * w1
                + (xx + yy) * w2 * w2
                - 2 * (yz * w1 * w2 + zx * w2 * w0 + xy * w0 * w1)
            )
        if tree.parent[j] >= 0:
            for k in range(MOMENTS):
                moments[tree.parent[j], k] += moments[j, k]


@borrowing
def factor(
    tree: Tree,
    axes: Array,
    wrench: Array,
    share: float,
    free: Array,
    extra: Array,
    A: Array,
    rows: Array,
) -> bool:
    """Write the factored matrix's `rows` (n, 13); False if it is not positive definite.

    `share` is 1 for the true Hessian, 0 for Gauss-Newton's, `extra` (n,) is added to
    the diagonal, and degrees of freedom that are not `free` are left out. `wrench` is
    that of :func:`slope`; `A` (J, 21) is that of the markers on each joint and is lost.
    """
    for j in range(len(A) - 1, -1, -1):
        a00, a01, a02, a03 = A[j, 0], A[j, 1], A[j, 2], A[j, 3]
        a04, a05, a11, a12 = A[j, 4], A[j, 5], A[j, 6], A[j, 7]
        a13, a14, a15, a22 = A[j, 8], A[j, 9], A[j, 10], A[j, 11]
        a23, a24, a25, a33 = A[j, 12], A[j, 13], A[j, 14], A[j, 15]
        a34, a35, a44 = A[j, 16], A[j, 17], A[j, 18]
        a45, a55 = A[j, 19], A[j, 20]
        n = 6 if tree.kind[j] == FREE_FLYER else 1
        f0 = f1 = f2 = h0 = h1 = h2 = 0.0
        if n == 1 and share > 0:
            half = 0.5 * share
            f0, f1, f2 = half * wrench[j, 0], half * wrench[j, 1], half * wrench[j, 2]
            h0, h1, h2 = half * wrench[j, 3], half * wrench[j, 4], half * wrench[j, 5]
        first, parent = tree.first_v[j], tree.parent[j]
        for d in range(first + n - 1, first - 1, -1):
            if free[d] == 0:
                for k in range(ROW):
                    rows[d, k] = 0.0
                continue
            # Sums in pairs, as the next degree of freedom waits for them.
            v0, v1, v2 = axes[d, 0], axes[d, 1], axes[d, 2]
            w0, w1, w2 = axes[d, 3], axes[d, 4], axes[d, 5]
            u0 = (a00 * v0 + a01 * v1) + (a02 * v2 + a03 * w0)
            u1 = (a01 * v0 + a11 * v1) + (a12 * v2 + a13 * w0)
            u2 = (a02 * v0 + a12 * v1) + (a22 * v2 + a23 * w0)
            u3 = (a03 * v0 + a13 * v1) + (a23 * v2 + a33 * w0)
            u4 = (a04 * v0 + a14 * v1) + (a24 * v2 + a34 * w0)
            u5 = (a05 * v0 + a15 * v1) + (a25 * v2 + a35 * w0)
            u0 += (a04 * w1 + a05 * w2) - (f1 * w2 - f2 * w1)
            u1 += (a14 * w1 + a15 * w2) - (f2 * w0 - f0 * w2)
            u2 += (a24 * w1 + a25 * w2) - (f0 * w1 - f1 * w0)
            u3 += (a34 * w1 + a35 * w2) - (f1 * v2 - f2 * v1 + h1 * w2 - h2 * w1)
            u4 += (a44 * w1 + a45 * w2) - (f2 * v0 - f0 * v2 + h2 * w0 - h0 * w2)
            u5 += (a45 * w1 + a55 * w2) - (f0 * v1 - f1 * v0 + h0 * w1 - h1 * w0)
            pivot = (v0 * u0 + v1 * u1) + (v2 * u2 + w0 * u3)
            pivot += (w1 * u4 + w2 * u5) + extra[d]
            # A NaN is not greater than zero either.
            if not pivot > 0:
                return False
            s = 1 / pivot
            for k in range(6):
                rows[d, k] = axes[d, k]
            rows[d, 6], rows[d, 7], rows[d, 8] = u0, u1, u2
            rows[d, 9], rows[d, 10], rows[d, 11] = u3, u4, u5
            rows[d, 12] = s
            s0, s1, s2, s3, s4, s5 = s * u0, s * u1, s * u2, s * u3, s * u4, s * u5
            a00, a01, a02 = a00 - s0 * u0, a01 - s0 * u1, a02 - s0 * u2
            a03, a04, a05 = a03 - s0 * u3, a04 - s0 * u4, a05 - s0 * u5
            a11, a12, a13 = a11 - s1 * u1, a12 - s1 * u2, a13 - s1 * u3
            a14, a15 = a14 - s1 * u4, a15 - s1 * u5
            a22, a23 = a22 - s2 * u2, a23 - s2 * u3
            a24, a25 = a24 - s2 * u4, a25 - s2 * u5
            a33, a34, a35 = a33 - s3 * u3, a34 - s3 * u4, a35 - s3 * u5
            a44, a45, a55 = a44 - s4 * u4, a45 - s4 * u5, a55 - s5 * u5
        if parent >= 0:
            i = parent
            A[i, 0], A[i, 1] = A[i, 0] + a00, A[i, 1] + a01
            A[i, 2], A[i, 3] = A[i, 2] + a02, A[i, 3] + a03
            A[i, 4], A[i, 5] = A[i, 4] + a04, A[i, 5] + a05
            A[i, 6], A[i, 7] = A[i, 6] + a11, A[i, 7] + a12
            A[i, 8], A[i, 9] = A[i, 8] + a13, A[i, 9] + a14
            A[i, 10], A[i, 11] = A[i, 10] + a15, A[i, 11] + a22
            A[i, 12], A[i, 13] = A[i, 12] + a23, A[i, 13] + a24
            A[i, 14], A[i, 15] = A[i, 14] + a25, A[i, 15] + a33
            A[i, 16], A[i, 17] = A[i, 16] + a34, A[i, 17] + a35
            A[i, 18], A[i, 19] = A[i, 18] + a44, A[i, 19] + a45
            A[i, 20] += a55
    return True


@borrowing
def solve(tree: Tree, rows: Array, T: Array, x: Array) -> None:
    """Solve H x = b in place, (n,), for the matrix that `rows` are of.

    `T` (J, 6) are afterwards the twists of the joints at rates x.
    """
    for j in range(len(T)):
        for k in range(6):
            T[j, k] = 0.0
    for j in range(len(T) - 1, -1, -1):
        i, first = tree.parent[j], tree.first_v[j]
        b0, b1, b2, b3, b4, b5 = T[j, 0], T[j, 1], T[j, 2], T[j, 3], T[j, 4], T[j, 5]
        n = 6 if tree.kind[j] == FREE_FLYER else 1
        for d in range(first + n - 1, first - 1, -1):
            y = (rows[d, 0] * b0 + rows[d, 1] * b1) + (rows[d, 2] * b2 + x[d])
            y += rows[d, 3] * b3 + rows[d, 4] * b4 + rows[d, 5] * b5
            y *= rows[d, 12]
            x[d] = y
            b0, b1, b2 = b0 - rows[d, 6] * y, b1 - rows[d, 7] * y, b2 - rows[d, 8] * y
            b3, b4, b5 = b3 - rows[d, 9] * y, b4 - rows[d, 10] * y, b5 - rows[d, 11] * y
        if i >= 0:
            T[i, 0], T[i, 1], T[i, 2] = T[i, 0] + b0, T[i, 1] + b1, T[i, 2] + b2
            T[i, 3], T[i, 4], T[i, 5] = T[i, 3] + b3, T[i, 4] + b4, T[i, 5] + b5
    for j in range(len(T)):
        i, first = tree.parent[j], tree.first_v[j]
        b0 = b1 = b2 = b3 = b4 = b5 = 0.0
        if i >= 0:
            b0, b1, b2, b3 = T[i, 0], T[i, 1], T[i, 2], T[i, 3]
            b4, b5 = T[i, 4], T[i, 5]
        for d in range(first, first + (6 if tree.kind[j] == FREE_FLYER else 1)):
            y = (rows[d, 6] * b0 + rows[d, 7] * b1) + (
                rows[d, 8] * b2 + rows[d, 9] * b3
            )
            y += rows[d, 10] * b4 + rows[d, 11] * b5
            y = x[d] - y * rows[d, 12]
            x[d] = y
            b0, b1, b2 = b0 + rows[d, 0] * y, b1 + rows[d, 1] * y, b2 + rows[d, 2] * y
            b3, b4, b5 = b3 + rows[d, 3] * y, b4 + rows[d, 4] * y, b5 + rows[d, 5] * y
        T[j, 0], T[j, 1], T[j, 2], T[j, 3], T[j, 4], T[j, 5] = b0, b1, b2, b3, b4, b5
