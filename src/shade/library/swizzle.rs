//! Parts of vectors: `v.x`, `v.rgb`, `v.zy`, and the same to the left of `=`.

use rhai::{Dynamic, Engine, ImmutableString};

use super::operand::{Operand, Outcome, kind};
use super::vectors::Vector;
use crate::math::{Vec2, Vec3, Vec4};
use crate::shade::fault::Fault;

const SPELLINGS: [[char; 4]; 2] = [['x', 'y', 'z', 'w'], ['r', 'g', 'b', 'a']];

pub(super) fn register(engine: &mut Engine) {
    parts::<Vec2>(engine);
    parts::<Vec3>(engine);
    parts::<Vec4>(engine);
}

fn parts<V: Vector>(engine: &mut Engine) {
    for letters in SPELLINGS {
        for (a, first) in letters.into_iter().enumerate().take(V::WIDTH) {
            let name = first.to_string();
            engine.register_get(&name, move |v: &mut V| v.get(a));
            engine.register_set(&name, move |v: &mut V, value: Dynamic| assign(v, &[a], &value));
            for (b, second) in letters.into_iter().enumerate().take(V::WIDTH) {
                let name = format!("{first}{second}");
                engine.register_get(&name, move |v: &mut V| Vec2::new(v.get(a), v.get(b)));
                if a != b {
                    engine.register_set(&name, move |v: &mut V, value: Dynamic| assign(v, &[a, b], &value));
                }
                for (c, third) in letters.into_iter().enumerate().take(V::WIDTH) {
                    let name = format!("{first}{second}{third}");
                    engine.register_get(&name, move |v: &mut V| Vec3::new(v.get(a), v.get(b), v.get(c)));
                    if a != b && b != c && a != c {
                        engine.register_set(&name, move |v: &mut V, value: Dynamic| assign(v, &[a, b, c], &value));
                    }
                }
            }
        }
    }
    engine.register_indexer_get(|_: &mut V, name: ImmutableString| -> Outcome { Err(unknown::<V>(&name).into()) });
    engine.register_indexer_set(|_: &mut V, name: ImmutableString, _: Dynamic| -> Outcome<()> {
        Err(unknown::<V>(&name).into())
    });
    engine.register_indexer_get(|v: &mut V, index: i64| lane::<V>(index).map(|i| v.get(i)));
    engine.register_indexer_set(|v: &mut V, index: i64, value: Dynamic| -> Outcome<()> {
        assign(v, &[lane::<V>(index)?], &value)
    });
}

/// Puts a vector's components, or one number, into the named lanes.
fn assign<V: Vector>(v: &mut V, lanes: &[usize], value: &Dynamic) -> Outcome<()> {
    let found = Operand::of(value).filter(|operand| operand.width() == 1 || operand.width() == lanes.len());
    let Some(operand) = found else {
        let wanted = if lanes.len() == 1 { "a number".to_owned() } else { format!("a vec{} or a number", lanes.len()) };
        return Err(Fault::new(format!("this part of a {} takes {wanted}, not {}", V::NAME, kind(value))).into());
    };
    for (from, &to) in lanes.iter().enumerate() {
        v.set(to, operand.lane(from));
    }
    Ok(())
}

fn lane<V: Vector>(index: i64) -> Outcome<usize> {
    usize::try_from(index).ok().filter(|i| *i < V::WIDTH).ok_or_else(|| {
        Fault::new(format!("index {index} is out of range: a {} has {} components", V::NAME, V::WIDTH))
            .hint("the first component is number 0")
            .into()
    })
}

fn unknown<V: Vector>(name: &str) -> Fault {
    let spell = |letters: &[char]| letters.iter().map(char::to_string).collect::<Vec<_>>().join(" ");
    let [xyzw, rgba] = SPELLINGS.map(|letters| spell(&letters[..V::WIDTH]));
    Fault::new(format!("a {} has no `{name}`", V::NAME))
        .hint(format!("its parts are {xyzw}, or {rgba}, and two or three of them together, as in `.{}{}`", 'x', 'y'))
}
