"""Reads and writes the raw format of Springline: see docs/formats.md. Needs numpy; the arrays are views of the bytes received."""

import json

import numpy

MAGIC = b"SPRLINE1"


def decode(body):
    """An answer, with a numpy array for each list of numbers."""
    if body[:8] != MAGIC:
        raise ValueError("not the raw format")
    start = 16 + int.from_bytes(body[8:12], "little")

    def view(found):
        for name, kind in ("$f64", "<f8"), ("$f32", "<f4"):
            if name in found:
                at, rows, columns = found[name]
                kind = numpy.dtype(kind)
                numbers = numpy.frombuffer(body, kind, rows * (columns or 1), start + at * kind.itemsize)
                return numbers.reshape(rows, columns) if columns else numbers
        return found

    return json.loads(body[16:start], object_hook=view)


def encode(request):
    """A request body, its numpy arrays sent as numbers."""
    arrays, count = [], 0

    def place(array):
        nonlocal count
        at, count = count, count + array.size
        arrays.append(numpy.ascontiguousarray(array, "<f8"))
        return {"$f64": [at, len(array), array.shape[1] if array.ndim == 2 else 0]}

    header = json.dumps(request, default=place).encode()
    header += b" " * (-len(header) % 8)
    return b"".join([MAGIC, len(header).to_bytes(4, "little"), bytes(4), header, *(array.tobytes() for array in arrays)])
