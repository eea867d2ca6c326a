"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .formats import Format as Format
from .formats import export_annotation as export_annotation
from .formats import import_annotation as import_annotation
from .links import keep_links as keep_links
from .links import seats_of as seats_of
from .log import ADJUDICATED as ADJUDICATED
from .log import AnnotationLog as AnnotationLog
from .log import annotators_of as annotators_of
from .log import check_name as check_name
from .log import log_path as log_path
from .log import read_annotation as read_annotation
from .marks import Annotation as Annotation
from .server import AnnotationServer as AnnotationServer
from .source_text import SourceText as SourceText
from .workplace import SeatKind as SeatKind
from .workplace import Workplace as Workplace
