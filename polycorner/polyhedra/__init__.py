"""Sets carved out by smooth inequalities joined by and/or, and the faces they have."""
