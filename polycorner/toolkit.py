"""What applications are built with: values, checks of arguments, printing, progress, files.

An application, such as ``polycorner.dumbbells``, imports the public names of the rooms and of this
module, and those of ``polycorner.cli`` for its commands.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub("polycorner", __file__)
