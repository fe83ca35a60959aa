from .applications import live_application, page_application
from .board import Descent, descent
from .page import atlas_page, film_page, write_page
from .server import PortTakenError, bound, serve

__all__ = [
    "Descent",
    "PortTakenError",
    "atlas_page",
    "bound",
    "descent",
    "film_page",
    "live_application",
    "page_application",
    "serve",
    "write_page",
]
