"""From Blender's evaluated scene to a folder that Lightmill renders: see README.md."""
from .content import Cache
from .frame import Export, export_frame
from .report import Message

__all__ = ["Cache", "Export", "Message", "export_frame"]
