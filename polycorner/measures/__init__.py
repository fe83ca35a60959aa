"""Measures on strata: what corners, edges, faces and D itself weigh, samples of them, and rates.

**Strata and contacts.**  Let ``D`` be given by inequalities ``f_i >= 0`` and equations ``h = 0``
in scaled coordinates ``u = q / scales``, and let ``D_I`` be the stratum on which exactly the
contacts ``i`` in ``I`` vanish.  A contact that attracts over a range that is small against
everything else has the Boltzmann factor ``1 + kappa_i delta(f_i)``: ``kappa_i``, its
*stickiness*, is the integral of ``exp(-U_i / T) - 1`` over the well, in the units of ``f_i``
([HGB]; for distances it is Baxter's parameter).  The Boltzmann factor of all contacts and of an
energy ``E`` is then

``exp(-E / T) prod_i (1 + kappa_i delta(f_i))``
``= sum_I exp(-E / T) prod_{i in I} kappa_i delta(f_i)``.

**Coarea formula.**  Let ``A`` have the rows ``df_i``, ``i`` in ``I``, projected onto the tangent
space of ``h = 0``.  Where they are independent,

``prod_{i in I} delta(f_i) = sigma / sqrt(det A A^T)``,

with the surface measure ``sigma`` of ``D_I``: the density is the inverse product of the singular
values of ``A``.  So a stratum weighs

``kappa^|I| Z_I,   Z_I = integral over D_I of exp(-E / T) / sqrt(det A A^T) d sigma``.

``Z_I`` does not depend on the scales but for a factor that all strata share.  In the *sticky
limit* ``kappa`` goes to infinity with the energy of a bond, and the strata with the most
contacts, the corners, have all the weight.  A contact ``g(f)`` with ``g(0) = 0`` has the weight
of ``f`` divided by ``g'(0)``: ``|x|^2 - 1`` counts half of what ``|x| - 1`` counts.

**Symmetry.**  Let a group of isometries act, its Lie algebra spanned by fields ``t_1, ..., t_g``.
An orbit has the volume ``sqrt(det T T^T)``, ``T`` with the rows ``t_a(u)``, times that of the
group, which all orbits share; across the orbits one integrates by the surface measure orthogonal
to them. For rigid motions ``det T T^T = n^3 det(inertia)``: the product of the three moments of
inertia.  A finite group has orbits of ``|G| / |S|`` points, ``S`` the stabiliser: a stratum of
the quotient is weighed once, over the order of the group that carries it to itself (its symmetry
number).

At a corner nothing is left to integrate: ``Z = sqrt(det T T^T) / (|S| |det(A; t)|)``, ``t`` an
orthonormal basis of the orbit's directions ([HGB], [MABM]).

**Where this ends.**  Gradients that are dependent at a point, or on a stratum, make ``Z`` infinite
in the limit; the weight then depends on the shape of the well ([KHC]).  Corners of this kind have
a weight where wells are harmonic, with a given stiffness (:mod:`polycorner.measures.wells`), and
are declined otherwise; edges of this kind are always declined.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
