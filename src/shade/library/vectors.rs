//! vec2, vec3 and vec4: making them, operators, geometry.
//!
//! Sums run over the components in order: `dot(a, b)` is `((a.x * b.x + a.y * b.y) + a.z * b.z) + a.w * b.w`.

#![expect(clippy::cast_precision_loss, reason = "an int counts as the nearest float")]

use rhai::{Dynamic, Engine};

use super::Function;
use super::operand::{Operand, Outcome, number, refuse};
use crate::math::{Vec2, Vec3, Vec4};

pub(super) const FUNCTIONS: &[Function] = &[
    Function {
        name: "vec2",
        form: "vec2(x, y)",
        about: "two numbers; also vec2(x), or a longer vector's first two",
        types: "numbers or vectors → vec2",
        example: "vec2(hit.position.x, hit.position.z).x",
    },
    Function {
        name: "vec3",
        form: "vec3(x, y, z)",
        about: "three numbers; also vec3(x), vec3(xy, z), vec3(xyzw)",
        types: "numbers or vectors → vec3",
        example: "vec3(hit.uv, 0.5)",
    },
    Function {
        name: "vec4",
        form: "vec4(x, y, z, w)",
        about: "four numbers; also vec4(x), vec4(xyz, w), vec4(xy, zw)",
        types: "numbers or vectors → vec4",
        example: "vec4(hit.normal, 1.0).w",
    },
    Function {
        name: "dot",
        form: "dot(a, b)",
        about: "sum of the products of the components",
        types: "two vectors of one size → number",
        example: "dot(hit.normal, -hit.incoming)",
    },
    Function {
        name: "cross",
        form: "cross(a, b)",
        about: "the vec3 at right angles to two others",
        types: "vec3, vec3 → vec3",
        example: "cross(hit.normal, hit.tangent.xyz)",
    },
    Function {
        name: "length",
        form: "length(v)",
        about: "sqrt(dot(v, v))",
        types: "vector → number, 0 or more",
        example: "length(hit.position)",
    },
    Function {
        name: "distance",
        form: "distance(a, b)",
        about: "length(a − b)",
        types: "two vectors of one size → number, 0 or more",
        example: "distance(hit.uv, vec2(0.5, 0.5))",
    },
    Function {
        name: "normalize",
        form: "normalize(v)",
        about: "v / length(v); a vector of length 0 stays 0",
        types: "vector → the same, of length 1",
        example: "normalize(hit.position)",
    },
    Function {
        name: "reflect",
        form: "reflect(incoming, normal)",
        about: "incoming − normal·(2·dot(normal, incoming))",
        types: "two vectors of one size → the same",
        example: "reflect(hit.incoming, hit.normal)",
    },
    Function {
        name: "refract",
        form: "refract(incoming, normal, eta)",
        about: "the refracted direction, eta being the ratio of the indices (from / to); 0 at total reflection",
        types: "two vectors of one size, number → the same",
        example: "refract(hit.incoming, hit.normal, 1.0 / 1.5)",
    },
];

/// The vectors, seen as their components.
pub(super) trait Vector: Copy + Clone + Send + Sync + 'static {
    const NAME: &'static str;
    const WIDTH: usize;
    fn from_fn(f: impl FnMut(usize) -> f32) -> Self;
    fn get(self, index: usize) -> f32;
    fn set(&mut self, index: usize, value: f32);
}

macro_rules! vector {
    ($type:ty, $name:literal, $width:literal) => {
        impl Vector for $type {
            const NAME: &'static str = $name;
            const WIDTH: usize = $width;
            fn from_fn(f: impl FnMut(usize) -> f32) -> Self {
                Self::from_array(std::array::from_fn(f))
            }
            fn get(self, index: usize) -> f32 {
                self[index]
            }
            fn set(&mut self, index: usize, value: f32) {
                self[index] = value;
            }
        }
    };
}
vector!(Vec2, "vec2", 2);
vector!(Vec3, "vec3", 3);
vector!(Vec4, "vec4", 4);

/// The sum of the products of the components, in order.
pub(super) fn dot<V: Vector>(a: V, b: V) -> f32 {
    (1..V::WIDTH).fold(a.get(0) * b.get(0), |sum, i| sum + a.get(i) * b.get(i))
}

/// `sqrt(dot(v, v))`.
pub(super) fn length<V: Vector>(v: V) -> f32 {
    dot(v, v).sqrt()
}

/// `v / length(v)`; 0 if the length is 0.
pub(super) fn normalize<V: Vector>(v: V) -> V {
    let length = length(v);
    if length == 0.0 { V::from_fn(|_| 0.0) } else { V::from_fn(|i| v.get(i) / length) }
}

/// For x, and likewise for y and z with the letters moved on: `a.y * b.z - b.y * a.z`.
fn cross(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y)
}

/// `i - n * (2 * dot(n, i))`.
fn reflect<V: Vector>(i: V, n: V) -> V {
    let twice = 2.0 * dot(n, i);
    V::from_fn(|lane| i.get(lane) - n.get(lane) * twice)
}

/// With `c = dot(n, i)` and `k = 1 - eta * eta * (1 - c * c)`: 0 if `k < 0`, else `i * eta - n * (eta * c + sqrt(k))`.
fn refract<V: Vector>(i: V, n: V, eta: f32) -> V {
    let c = dot(n, i);
    let k = 1.0 - eta * eta * (1.0 - c * c);
    if k < 0.0 {
        return V::from_fn(|_| 0.0);
    }
    let along = eta * c + k.sqrt();
    V::from_fn(|lane| i.get(lane) * eta - n.get(lane) * along)
}

pub(super) fn register(engine: &mut Engine) {
    register_kind::<Vec2>(engine);
    register_kind::<Vec3>(engine);
    register_kind::<Vec4>(engine);
    engine.register_fn("cross", cross);
    engine.register_fn("vec2", |x: f32, y: f32| Vec2::new(x, y));
    engine.register_fn("vec3", |x: f32, y: f32, z: f32| Vec3::new(x, y, z));
    engine.register_fn("vec3", |x: f32| Vec3::splat(x));
    engine.register_fn("vec4", |x: f32, y: f32, z: f32, w: f32| Vec4::new(x, y, z, w));
    engine.register_fn("vec4", |v: Vec3, w: f32| v.extend(w));
}

fn register_kind<V: Vector + PartialEq>(engine: &mut Engine) {
    engine.register_type_with_name::<V>(V::NAME);
    engine.register_fn(V::NAME, |a: Dynamic| gather::<V, 1>([a]));
    engine.register_fn(V::NAME, |a: Dynamic, b: Dynamic| gather::<V, 2>([a, b]));
    if V::WIDTH > 2 {
        engine.register_fn(V::NAME, |a: Dynamic, b: Dynamic, c: Dynamic| gather::<V, 3>([a, b, c]));
    }
    if V::WIDTH > 3 {
        engine.register_fn(V::NAME, |a: Dynamic, b: Dynamic, c: Dynamic, d: Dynamic| gather::<V, 4>([a, b, c, d]));
    }

    engine.register_fn("==", |a: V, b: V| a == b);
    engine.register_fn("!=", |a: V, b: V| a != b);
    engine.register_fn("-", |v: V| V::from_fn(|i| -v.get(i)));
    engine.register_fn("+", |v: V| v);
    operator::<V>(engine, "+", "+=", |a, b| a + b);
    operator::<V>(engine, "-", "-=", |a, b| a - b);
    operator::<V>(engine, "*", "*=", |a, b| a * b);
    operator::<V>(engine, "/", "/=", |a, b| a / b);

    engine.register_fn("dot", dot::<V>);
    engine.register_fn("length", length::<V>);
    engine.register_fn("distance", |a: V, b: V| length(V::from_fn(|i| a.get(i) - b.get(i))));
    engine.register_fn("normalize", normalize::<V>);
    engine.register_fn("reflect", reflect::<V>);
    engine.register_fn("refract", |i: V, n: V, eta: Dynamic| -> Outcome<V> {
        Ok(refract(i, n, number("refract", &eta)?))
    });
    engine.register_fn("to_string", |v: &mut V| show(*v));
    engine.register_fn("to_debug", |v: &mut V| show(*v));
}

/// `vector op vector`, `vector op number` and `number op vector`, component by component, and `op=`.
fn operator<V: Vector>(engine: &mut Engine, name: &str, assigning: &str, f: fn(f32, f32) -> f32) {
    engine.register_fn(name, move |a: V, b: V| V::from_fn(|i| f(a.get(i), b.get(i))));
    engine.register_fn(name, move |a: V, b: f32| V::from_fn(|i| f(a.get(i), b)));
    engine.register_fn(name, move |a: V, b: i64| V::from_fn(|i| f(a.get(i), b as f32)));
    engine.register_fn(name, move |a: f32, b: V| V::from_fn(|i| f(a, b.get(i))));
    engine.register_fn(name, move |a: i64, b: V| V::from_fn(|i| f(a as f32, b.get(i))));
    engine.register_fn(assigning, move |a: &mut V, b: V| *a = V::from_fn(|i| f(a.get(i), b.get(i))));
    engine.register_fn(assigning, move |a: &mut V, b: f32| *a = V::from_fn(|i| f(a.get(i), b)));
    engine.register_fn(assigning, move |a: &mut V, b: i64| *a = V::from_fn(|i| f(a.get(i), b as f32)));
}

/// A vector from parts whose components add up to its size, from one number for all, or from a longer vector's start.
pub(super) fn gather<V: Vector, const N: usize>(parts: [Dynamic; N]) -> Outcome<V> {
    let mut lanes = [0.0; 4];
    let mut filled = 0;
    for part in &parts {
        let Some(operand) = Operand::of(part) else { return Err(refuse(V::NAME, &parts)) };
        if N == 1 && (operand.width() == 1 || operand.width() > V::WIDTH) {
            return Ok(V::from_fn(|i| operand.lane(i)));
        }
        for i in 0..operand.width() {
            if filled == V::WIDTH {
                return Err(refuse(V::NAME, &parts));
            }
            lanes[filled] = operand.lane(i);
            filled += 1;
        }
    }
    if filled == V::WIDTH { Ok(V::from_fn(|i| lanes[i])) } else { Err(refuse(V::NAME, &parts)) }
}

fn show<V: Vector>(v: V) -> String {
    let lanes: Vec<_> = (0..V::WIDTH).map(|i| format!("{:?}", v.get(i))).collect();
    format!("{}({})", V::NAME, lanes.join(", "))
}
