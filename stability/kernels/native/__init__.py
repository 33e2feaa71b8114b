"""Machine code for the kernels: loops over arrays, written in a small part of Python, translated to LLVM.

A kernel is an ordinary Python function of numbers and C-contiguous arrays that consists of loops, arithmetic and calls
of other kernels. It is translated statement by statement (`statements`, `expressions`, `functions`), compiled by
llvmlite and kept on disk (`machine`, `store`), and called from Python through a border of its own (`border`). Why not a
general compiler of Python: these loops need none of its generality, and a tenth of its time.
"""
