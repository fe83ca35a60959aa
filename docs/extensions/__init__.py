"""What the site needs beside Sphinx: formulas, the gallery's pictures, a look at every link."""
