"""A body for ParaView and VTK: an unstructured grid as XML, with its arrays compressed in it."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Iterator, Mapping
from xml.sax.saxutils import quoteattr

import numpy as np

from pneumorph.output.grid import Grid

KINDS = {10: 24, 6: 22}
"""VTK's numbers of quadratic tetrahedra and triangles, by their nodes."""

TYPES = {"f4": "Float32", "f8": "Float64", "i4": "Int32", "i8": "Int64", "i1": "Int8", "u1": "UInt8"}
"""VTK's names of the types of values."""


def vtu_file(grid: Grid) -> bytes:
    """The file of a grid in mm, with its data."""
    return "\n".join(_lines(grid)).encode()


def _lines(grid: Grid) -> Iterator[str]:
    nodes = np.concatenate([cells.ravel() for cells in grid.cells])
    sizes = np.repeat([cells.shape[1] for cells in grid.cells], list(map(len, grid.cells)))
    kinds = np.repeat([KINDS[cells.shape[1]] for cells in grid.cells], list(map(len, grid.cells)))
    yield '<?xml version="1.0"?>'
    yield (
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
        'compressor="vtkZLibDataCompressor">'
    )
    yield f'<UnstructuredGrid><Piece NumberOfPoints="{len(grid.points)}" NumberOfCells="{len(kinds)}">'
    yield from _group("Points", {"Points": grid.points})
    yield from _group("Cells", {"connectivity": nodes, "offsets": np.cumsum(sizes), "types": kinds.astype(np.uint8)})
    yield from _group("PointData", grid.point_data)
    yield from _group("CellData", grid.cell_data)
    yield "</Piece></UnstructuredGrid></VTKFile>\n"


def _group(name: str, arrays: Mapping[str, np.ndarray]) -> Iterator[str]:
    yield f"<{name}>"
    for own, values in arrays.items():
        kind = f"{values.dtype.kind}{values.dtype.itemsize}"
        parts = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
        yield f'<DataArray type="{TYPES[kind]}" Name={quoteattr(own)}{parts} format="binary">'
        yield _packed(values.astype(f"<{kind}").tobytes())
        yield "</DataArray>"
    yield f"</{name}>"


def _packed(data: bytes) -> str:
    """Bytes as one compressed block, after its sizes: blocks, of one, of a last shorter one, compressed."""
    if not data:
        return base64.b64encode(np.zeros(1, "<u8").tobytes()).decode()
    block = zlib.compress(data)
    sizes = np.array([1, len(data), 0, len(block)], "<u8")
    return (base64.b64encode(sizes.tobytes()) + base64.b64encode(block)).decode()
