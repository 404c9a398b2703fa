"""A page to print at its true size: bars and words in millimetres, as PDF or SVG. Nothing is scaled anywhere."""

from dataclasses import dataclass

PT_PER_MM = 72 / 25.4
"""PDF's own unit."""


@dataclass(frozen=True)
class Bar:
    """An upright rectangle, filled."""

    x_mm: float
    """Of its lower left corner, like y."""
    y_mm: float
    width_mm: float
    height_mm: float
    grey: float = 0.0
    """0 is black, 1 white."""


@dataclass(frozen=True)
class Words:
    """A line of text, ASCII only."""

    x_mm: float
    """Of its start on the line that letters stand on, like y."""
    y_mm: float
    text: str
    size_mm: float = 3.0
    """Height of the font; its capitals are 0.7 of it."""


@dataclass(frozen=True)
class Sheet:
    """Drawn in order, the origin in the lower left corner of the paper, y up."""

    width_mm: float
    height_mm: float
    bars: tuple[Bar, ...]
    words: tuple[Words, ...]


def as_pdf(sheet: Sheet) -> bytes:
    """One page, with the wish that viewers print it unscaled (ISO 32000-1, 12.2: PrintScaling)."""
    drawn = [f"{PT_PER_MM:.9f} 0 0 {PT_PER_MM:.9f} 0 0 cm"]
    drawn += [
        f"{bar.grey:g} g {bar.x_mm:.4f} {bar.y_mm:.4f} {bar.width_mm:.4f} {bar.height_mm:.4f} re f"
        for bar in sheet.bars
    ]
    drawn += [
        f"BT 0 g /F1 {words.size_mm:g} Tf {words.x_mm:.4f} {words.y_mm:.4f} Td ({_escaped(words.text)}) Tj ET"
        for words in sheet.words
    ]
    stream = "\n".join(drawn)
    box = f"[0 0 {sheet.width_mm * PT_PER_MM:.4f} {sheet.height_mm * PT_PER_MM:.4f}]"
    objects = [
        "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox {box} /Contents 5 0 R /Resources << /Font << /F1 4 0 R >> >> >>",
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
        f"<< /Length {len(stream)} >>\nstream\n{stream}\nendstream",
    ]
    content, offsets = "%PDF-1.7\n", []
    for number, body in enumerate(objects, start=1):
        offsets.append(len(content))
        content += f"{number} 0 obj\n{body}\nendobj\n"
    entries = "".join(f"{offset:010d} 00000 n \n" for offset in offsets)
    count = len(objects) + 1
    trailer = f"trailer\n<< /Size {count} /Root 1 0 R >>\nstartxref\n{len(content)}\n%%EOF\n"
    return f"{content}xref\n0 {count}\n0000000000 65535 f \n{entries}{trailer}".encode("ascii")


def as_svg(sheet: Sheet) -> str:
    """In millimetres; y runs down there."""
    from xml.sax.saxutils import escape

    def bar(it: Bar) -> str:
        level = round(255 * it.grey)
        return (
            f'<rect x="{it.x_mm:.4f}" y="{sheet.height_mm - it.y_mm - it.height_mm:.4f}" width="{it.width_mm:.4f}" '
            f'height="{it.height_mm:.4f}" fill="rgb({level},{level},{level})"/>'
        )

    def words(it: Words) -> str:
        return (
            f'<text x="{it.x_mm:.4f}" y="{sheet.height_mm - it.y_mm:.4f}" font-family="Helvetica, Arial, sans-serif" '
            f'font-size="{it.size_mm:g}">{escape(it.text)}</text>'
        )

    size = f'width="{sheet.width_mm:g}mm" height="{sheet.height_mm:g}mm"'
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} viewBox="0 0 {sheet.width_mm:g} {sheet.height_mm:g}" '
        'shape-rendering="crispEdges">',
        *(bar(it) for it in (Bar(0, 0, sheet.width_mm, sheet.height_mm, 1.0), *sheet.bars)),
        *(words(it) for it in sheet.words),
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def _escaped(text: str) -> str:
    return text.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")
