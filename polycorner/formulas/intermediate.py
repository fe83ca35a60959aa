"""Compiled functions with all that they call, as LLVM's intermediate code for any processor."""

import re
from collections.abc import Mapping
from typing import Any

from numba import types

from polycorner.formulas.linking import whole_module
from polycorner.formulas.machine_code import portable_code

# Properties of arguments that older versions do not know.
NEW = r" (captures\([^)]*\)|range\([^)]*\)|initializes\(\([^)]*\)\))"

# Numba's allocation of arrays, with reference counts.  Every array belongs to one call and thus to
# one thread, so that counting is not atomic.  As in Numba, memory begins with the count, and the
# address of the data is its fourth word.
MEMORY = """
declare ptr @malloc(i64)
declare void @free(ptr)

define ptr @NRT_MemInfo_alloc(i64 %size) {
  %all = add i64 %size, 48
  %memory = call ptr @malloc(i64 %all)
  %none = icmp eq ptr %memory, null
  br i1 %none, label %end, label %count
count:
  store i64 1, ptr %memory
  %data = getelementptr i8, ptr %memory, i64 48
  %address = getelementptr i8, ptr %memory, i64 24
  store ptr %data, ptr %address
  br label %end
end:
  ret ptr %memory
}

define ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %alignment) {
  %memory = call ptr @NRT_MemInfo_alloc(i64 %size)
  ret ptr %memory
}

define ptr @NRT_MemInfo_data_fast(ptr %memory) {
  %address = getelementptr i8, ptr %memory, i64 24
  %data = load ptr, ptr %address
  ret ptr %data
}

define void @NRT_incref(ptr %memory) {
  %none = icmp eq ptr %memory, null
  br i1 %none, label %end, label %count
count:
  %before = load i64, ptr %memory
  %after = add i64 %before, 1
  store i64 %after, ptr %memory
  br label %end
end:
  ret void
}

define void @NRT_decref(ptr %memory) {
  %none = icmp eq ptr %memory, null
  br i1 %none, label %end, label %count
count:
  %before = load i64, ptr %memory
  %after = sub i64 %before, 1
  store i64 %after, ptr %memory
  %last = icmp eq i64 %after, 0
  br i1 %last, label %release, label %end
release:
  call void @free(ptr %memory)
  br label %end
end:
  ret void
}
"""


def intermediate_code(functions: Mapping[str, Any], arguments: int) -> str:
    """Return functions of so many whole numbers by name, linked into one text and optimised.

    Words that only one version of LLVM knows are left out: once code is optimised, they matter
    little.
    """
    module, names = whole_module(functions.values(), (types.int64,) * arguments, MEMORY)
    text = portable_code(str(module))
    for name, entry in zip(names, functions, strict=True):
        text = text.replace(name, entry)
    for words in (r"^(attributes #|source_filename|; ModuleID|target ).*\n", r" #\d+(?=\s|$)", NEW):
        text = re.sub(words, "", text, flags=re.MULTILINE)
    for constant in re.findall(r".*\.py.*|.*PyErr.*", text):
        msg = f"an exception holds the path of a file, or is made by Python: {constant}"
        raise ValueError(msg)
    return text
