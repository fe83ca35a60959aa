"""Compiled descent of an energy on a polyhedron, one file a stage.

All vectors are in scaled coordinates ``u = q / scales``.  A problem is a tuple of flat arrays

=========  ==============================================================================
table      (G, 7) int64: addresses of a kernel's point routines with and without Hessians, its
           variables, its outputs, where its reads, rows and parameters start
reads      coordinate read by each variable of each call
rows       row of the system each output goes to, or -1
parameters numbers, call after call
scales     (n,)
=========  ==============================================================================

Rows: ``m`` inequalities ``f >= 0``, then the equations ``h = 0``, then the energy.  Throughout,
``use`` (m,) says which inequalities define the piece, ``on`` (m,) which of them are held at zero;
``F``, ``J`` and ``H`` hold values, scaled gradients and scaled Hessians of all rows, ``size`` is
the number of scratch entries a kernel call needs.
"""
