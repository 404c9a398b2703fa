"""A paste measured by what a lab has: a cone and a phone, or a rheometer's table; its file is what a trial takes."""
