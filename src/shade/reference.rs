//! The reference of the shading language, made from the tables that the code itself uses.

use std::fmt::Write;

use super::library;
use super::names::{AOV_PREFIX, INPUTS, LINE_OUTPUTS, OUTPUTS, PAIR_INPUTS};

/// What stands before the tables.
const HEAD: &str = "\
# Shaders

A shader is a `.rhai` file. `params()` gives its parameters with their defaults; `surface(hit, p)` is called for every hit
and returns a record of outputs. Each file of this folder is a lesson on one idea, and can be used as `builtin:NAME`.

```rust
//! Cel shading whose ink thickens in shadow.
fn params() {
    #{ paint: rgb(0.9, 0.5, 0.2), ink_width: 3.0 }
}
fn surface(hit, p) {
    let lit = step(0.1, luminance(hit.irradiance));
    #{ base_color: p.paint * (0.5 + 0.5 * lit), feature: gray(lit), line_width: p.ink_width * (1.5 - lit) }
}
```

- Numbers are ints (`2`) or floats (`2.0`); wherever a number is expected, either will do. `7 / 2` of ints is 3.
- Vectors are vec2, vec3 and vec4, with parts `x y z w` or `r g b a`, alone or several together (`v.xy`, `c.bgr`).
  `+ - * /` work part by part, and between vectors and numbers. A colour is a vec3 of linear Rec. 709.
- `PI` and `TAU` are numbers. Texts are written `\"so\"`, records `#{ key: value }`, arrays `[1, 2]`.
- A closure is bound to a local and called by its name: `let f = |x| x * 2.0; f.call(3.0)`. It shares the variables around
  it, and cannot be stored or passed on.
- `import \"lib/hatching\" as h;` at the head of a script makes the functions of `lib/hatching.rhai`, beside it, callable as
  `h::stroke(…)`; those marked `private` are not. `builtin:lib/hatching` comes with Tusche. A module sees only its own
  functions and imports.
- There are no files, no clock and no chance: a shader's result depends on the hit and the parameters alone.

This page is made from the code: `tusche shader reference` prints it.
";

/// What becomes of useless numbers.
const GATE: &str = "
What is outside of its range is brought into it; NaN in what describes scattering is the default. A colour or extra layer that is
NaN, infinite or beyond ±1e30 at some hit is 0 there, such a normal is +Z, and a line whose width or opacity is NaN or infinite is not
drawn. The render says which shader it was and how often, and `--stats` counts it. Kernels and the interpreter agree on all of this.
";

/// What stands before the tables of `line`.
const LINES: &str = "
## Lines, one by one

A shader may also have a function `line(pair, p)`. It is called for every line that a sample sees and that this shader
styles, and may change its colour and opacity there: gradients across the line, ink that fades with depth, dashes, texture.

```rust
fn line(pair, p) {
    if pair.kind == \"crease\" && pair.other.depth < pair.depth { return #{ opacity: 0.5 }; }
    #{ color: mix(pair.color, p.paint, pair.distance), opacity: 1.0 - smoothstep(10.0, 40.0, pair.depth) }
}
```

`pair` is the surface that styles the line; `pair.other` is what lies across the edge, and has the names from `object_id`
on. Where lines are drawn, and how wide, is decided before.

";

/// The whole reference as Markdown: what `shaders/README.md` holds and `tusche shader reference` prints.
#[must_use]
pub fn markdown() -> String {
    let mut page = HEAD.to_owned();
    page += "\n## Inputs\n\nRead as `hit.NAME`. What no shader reads is not computed.\n\n";
    page += "| name | type | unit or space | range | meaning |\n|---|---|---|---|---|\n";
    for input in INPUTS {
        row(&mut page, &[&code(input.name), input.kind, input.unit, input.range, input.about]);
    }
    page += "\n## Outputs\n\nKeys of the record that `surface` returns; what is left out has its default. ";
    page += "Where a colour is expected, a number stands for a gray.\n\n";
    page += "| key | type | unit or space | range | default | meaning |\n|---|---|---|---|---|---|\n";
    for output in OUTPUTS {
        let cells = [output.kind, output.unit, output.range, output.default, output.about];
        row(&mut page, &[&[code(output.name).as_str()], &cells[..]].concat());
    }
    let extra = code(&format!("{AOV_PREFIX}NAME"));
    row(&mut page, &[&extra, "colour or number", "", "", "0", "an extra layer of the picture, called NAME"]);
    page += GATE;
    page += LINES;
    page += "| name | type | unit or space | range | meaning |\n|---|---|---|---|---|\n";
    for input in PAIR_INPUTS {
        row(&mut page, &[&code(input.name), input.kind(), input.unit, input.range, input.about]);
    }
    page += "\n| key | type | range | default | meaning |\n|---|---|---|---|---|\n";
    for [key, cells @ ..] in LINE_OUTPUTS {
        row(&mut page, &[&[code(key).as_str()], &cells[..]].concat());
    }
    page += "\n## Functions\n\n";
    page += "| call | types | meaning | example |\n|---|---|---|---|\n";
    for function in library::functions() {
        row(&mut page, &[&code(function.form), function.types, function.about, &code(function.example)]);
    }
    page
}

fn code(text: &str) -> String {
    format!("`{text}`")
}

fn row(page: &mut String, cells: &[&str]) {
    // Writing to a text cannot fail.
    let _ = writeln!(page, "| {} |", cells.iter().map(|cell| cell.replace('|', "\\|")).collect::<Vec<_>>().join(" | "));
}
