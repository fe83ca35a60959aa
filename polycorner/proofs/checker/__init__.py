"""Checker of saved proofs: lists of stationary points or corners, minima and diagrams.

It needs python-flint alone.
``python -m checker FILE [--sample K] [--jobs J]``, run where this folder or a copy of it is,
differentiates the program in the file itself, walks the subdivision and shows of every closed box,
in ball arithmetic of 128 bits, that

- no point of the set lies in it; or
- in each branch of the set, some stored direction, made tangent to the equations, increases all
  functions that may vanish and decreases the energy, for all elements of their generalised
  gradients ([Clarke] sec. 2.3); or the functions that may vanish are active in a region around the
  box; or one of both is true of each set of as many of them as can be independent; or the box is at
  a locus, and a direction along the other coordinates leads into the set; or
- a symmetry carries it into the domain and increases ``w . q``.

Boxes for which this is not shown at once are bisected.  Krawczyk's operator ([Neumaier] sec. 5.1)
shows that a region has one KKT point with positive multipliers, and a locus one zero of the
derivative of the energy in the coordinates that it depends on; or more functions than coordinates
hold a point to first order, and leave no other one in its region (``faces.py``).  The list must
consist of all regions whose point is stationary and not outside the domain, with their indices.

In a list of corners each set of functions that may vanish in a box vanishes nowhere there, or at
the point of a region only, or has independent gradients and too few of them for a corner, or has a
subset of the first two kinds.  Regions have one common zero of as many functions as there are
coordinates, by Krawczyk's operator, or one that second order isolates.

Files of single minima are checked by what ``growth.py`` and ``minimum.py`` state and prove, and
bifurcation diagrams by what ``diagrams.py``, ``arcs.py`` and ``events.py`` do.

What is shown is about the problem that the file states.  That its symmetries, and turns by the
periods of its coordinates, preserve this problem is shown by exact algebra (``symmetries.py``), or
tested at random points and said to be so.
"""
