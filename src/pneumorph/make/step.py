"""STEP files with named solids in millimetres."""

# pyright: reportAttributeAccessIssue=false, reportArgumentType=false
# OCP has no stubs: neither its names nor its types are known.
from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.BRep import BRep_Builder
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.Interface import Interface_Static
from OCP.Message import Message
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_Reader, STEPControl_StepModelType
from OCP.TCollection import TCollection_ExtendedString, TCollection_HAsciiString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopoDS import TopoDS_Compound, TopoDS_Shape
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from pneumorph import __version__
from pneumorph.geometry import Body
from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.make.solid import bonded_faces, fill_chamber, solid

# Otherwise OpenCASCADE prints messages for every file it writes.
Message.DefaultMessenger_s().ChangePrinters().Clear()


def write_body_step(body: Body, path: Path) -> None:
    """Write a body as one solid named "body", its chambers as inner shells.

    The faces are the body's cubic B-splines, cut at knots, and planes; nothing is approximated. Where the tip is a
    dome, what is bonded to the plate is faces of its own, named "tip".

    Parameters
    ----------
    body : Body
        In mm.
    path : Path
        The file; an existing one is replaced.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    made = solid(body.surfaces)
    write_step({"body": made}, path, faces={"tip": list(bonded_faces(made, body.exterior))})


def write_chamber_step(chamber: TubeSurface, path: Path) -> None:
    """Write the inside of a chamber as a solid, named "chamber" followed by the chamber's name.

    Parameters
    ----------
    chamber : TubeSurface
        In mm.
    path : Path
        The file; an existing one is replaced.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    write_step({f"chamber {chamber.name}": solid([fill_chamber(chamber)])}, path)


def read_step(path: Path) -> TopoDS_Shape:
    """Read the shape in a STEP file, in mm.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    reader = STEPControl_Reader()
    if reader.ReadFile(str(path)) != IFSelect_ReturnStatus.IFSelect_RetDone or reader.TransferRoots() < 1:
        raise OSError(f"{path}: is not a STEP file")
    return reader.OneShape()


def write_step(
    shapes: Mapping[str, TopoDS_Shape],
    path: Path,
    together: str = "",
    faces: Mapping[str, Sequence[TopoDS_Shape]] = MappingProxyType({}),
) -> None:
    """Write named shapes at their places, in mm.

    Parameters
    ----------
    shapes : mapping of str to TopoDS_Shape
    path : Path
    together : str
        Name of what they are parts of: some programs read only the first of shapes that are parts of nothing.
    faces : mapping of str to sequences of TopoDS_Shape
        Faces of the first shape that have a name in the file.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    document = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    XCAFDoc_DocumentTool.SetLengthUnit_s(document, 1e-3)
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    if together:
        whole, builder = TopoDS_Compound(), BRep_Builder()
        builder.MakeCompound(whole)
        for shape in shapes.values():
            builder.Add(whole, shape)
        TDataStd_Name.Set_s(tool.AddShape(whole, True), TCollection_ExtendedString(together))
    for name, shape in shapes.items():
        label = tool.FindShape(shape, False) if together else tool.AddShape(shape, False)
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
    first = tool.FindShape(next(iter(shapes.values())), False)
    for name, own in faces.items():
        for face in own:
            TDataStd_Name.Set_s(tool.AddSubShape(first, face), TCollection_ExtendedString(name))
    writer = STEPCAFControl_Writer()
    # Of writers made so far: it is a setting of OpenCASCADE, which the first one makes.
    Interface_Static.SetIVal_s("write.stepcaf.subshapes.name", 1)
    writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs)
    header = APIHeaderSection_MakeHeader(writer.ChangeWriter().Model())
    header.SetName(TCollection_HAsciiString(", ".join(shapes)))
    header.SetAuthorValue(1, TCollection_HAsciiString(""))
    header.SetOrganizationValue(1, TCollection_HAsciiString(""))
    header.SetOriginatingSystem(TCollection_HAsciiString(f"pneumorph {__version__}"))
    if writer.Write(str(path)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise OSError(f"{path}: cannot be written")
