//! Reduces a failing recipe to a small one that fails in the same way (Zeller and Hildebrandt, "Simplifying and Isolating
//! Failure-Inducing Input", 2002).

use super::recipe::{Body, Material, Recipe, Rough, Shape, Sky, Surface};

/// Maximum number of recipes tried; each is checked like the first one.
const TRIES: usize = 400;

/// The smallest failing recipe found: no simplification keeps the failure, or the tries are used up.
pub fn shrink(recipe: &Recipe, mut fails: impl FnMut(&Recipe) -> bool) -> Recipe {
    let (mut best, mut left) = (recipe.clone(), TRIES);
    loop {
        let simpler = simplifications(&best).into_iter().find(|candidate| {
            let try_it = left > 0 && candidate != &best;
            left -= usize::from(try_it);
            try_it && fails(candidate)
        });
        match simpler {
            Some(simpler) => best = simpler,
            None => return best,
        }
    }
}

/// Simpler recipes, the largest simplifications first.
fn simplifications(recipe: &Recipe) -> Vec<Recipe> {
    let mut all = Vec::new();
    let mut part = recipe.shapes.len();
    while part > 0 {
        for start in (0..recipe.shapes.len()).step_by(part) {
            let kept = |&i: &usize| i < start || i >= start + part;
            let shapes = (0..recipe.shapes.len()).filter(kept).map(|i| recipe.shapes[i].clone());
            all.push(Recipe {
                shapes: shapes.collect(),
                ..recipe.clone()
            });
        }
        part /= 2;
    }
    for at in 0..recipe.lamps.len() {
        let mut simpler = recipe.clone();
        simpler.lamps.remove(at);
        all.push(simpler);
    }
    all.extend(less_of_the_whole(recipe));
    for (at, shape) in recipe.shapes.iter().enumerate() {
        all.extend(simpler_shapes(shape).into_iter().map(|shape| {
            let mut simpler = recipe.clone();
            simpler.shapes[at] = shape;
            simpler
        }));
    }
    for (at, material) in recipe.materials.iter().enumerate() {
        all.extend(simpler_materials(material).into_iter().map(|material| {
            let mut simpler = recipe.clone();
            simpler.materials[at] = material;
            simpler
        }));
    }
    all.extend(without_unused_materials(recipe));
    all
}

/// Simplifies the sky, the lens and the film.
fn less_of_the_whole(recipe: &Recipe) -> Vec<Recipe> {
    let mut all = Vec::new();
    if recipe.sky.is_some() {
        all.push(Recipe {
            sky: None,
            ..recipe.clone()
        });
    }
    if let Some(Sky::Picture(..)) = recipe.sky {
        let sky = Some(Sky::Constant([1.0; 3]));
        all.push(Recipe { sky, ..recipe.clone() });
    }
    if recipe.lens.is_some() {
        all.push(Recipe {
            lens: None,
            ..recipe.clone()
        });
    }
    let [width, height] = recipe.film;
    for film in [
        [width.div_ceil(2), height.div_ceil(2)],
        [width - 1, height],
        [width, height - 1],
    ] {
        if film[0] > 0 && film[1] > 0 {
            all.push(Recipe { film, ..recipe.clone() });
        }
    }
    all
}

fn simpler_shapes(shape: &Shape) -> Vec<Shape> {
    let mut all = Vec::new();
    let mut with = |body: Body| {
        all.push(Shape {
            body,
            surface: shape.surface.clone(),
        });
    };
    match &shape.body {
        Body::Sphere { center, radius } => with(Body::Sphere {
            center: center.map(rounded),
            radius: rounded(*radius).max(radius * 0.5),
        }),
        Body::Mesh {
            vertices,
            faces,
            uvs,
            smooth,
        } => {
            let mesh = |faces: &[[u32; 3]], uvs: &Option<Vec<[f64; 2]>>, smooth: bool| Body::Mesh {
                vertices: vertices.clone(),
                faces: faces.to_vec(),
                uvs: uvs.clone(),
                smooth,
            };
            if faces.len() > 1 {
                let (first, second) = faces.split_at(faces.len() / 2);
                with(mesh(first, uvs, *smooth));
                with(mesh(second, uvs, *smooth));
            }
            if *smooth {
                with(mesh(faces, uvs, false));
            }
            with(used(vertices, faces, uvs, *smooth));
        }
    }
    if let Surface::Emission(le) = shape.surface
        && le != [1.0; 3]
    {
        all.push(Shape {
            surface: Surface::Emission([1.0; 3]),
            ..shape.clone()
        });
    }
    all
}

/// A mesh with only the vertices that its faces use.
fn used(vertices: &[[f64; 3]], faces: &[[u32; 3]], uvs: &Option<Vec<[f64; 2]>>, smooth: bool) -> Body {
    let mut kept: Vec<u32> = faces.iter().flatten().copied().collect();
    kept.sort_unstable();
    kept.dedup();
    let place = |corner: u32| kept.binary_search(&corner).unwrap_or(0) as u32;
    Body::Mesh {
        vertices: kept.iter().map(|&i| vertices[i as usize]).collect(),
        faces: faces.iter().map(|face| face.map(place)).collect(),
        uvs: uvs.as_ref().map(|uvs| kept.iter().map(|&i| uvs[i as usize]).collect()),
        smooth,
    }
}

/// Rounds to two decimal digits.
fn rounded(x: f64) -> f64 {
    format!("{x:.1e}").parse().unwrap_or(x)
}

fn simpler_materials(material: &Material) -> Vec<Material> {
    let plain = Material {
        diffuse: Some([0.5; 3]),
        phong: None,
        rough: None,
        one_sided: false,
        texture: None,
    };
    let mut all = vec![
        plain.clone(),
        Material {
            texture: None,
            ..material.clone()
        },
        Material {
            one_sided: false,
            ..material.clone()
        },
    ];
    if let Some((rho, exponent)) = material.phong {
        let phong = Some((rho.map(|_| 0.5), rounded(exponent).max(1.5)));
        all.push(Material { phong, ..plain.clone() });
    }
    if let Some(Rough { body, roughness }) = &material.rough {
        let (body, roughness) = (body.clone(), rounded(*roughness).max(1e-4));
        all.push(Material {
            diffuse: None,
            rough: Some(Rough { body, roughness }),
            ..plain
        });
    }
    all
}

/// Removes unused materials and renumbers the others.
fn without_unused_materials(recipe: &Recipe) -> Option<Recipe> {
    let used = |number: &usize| {
        recipe
            .shapes
            .iter()
            .any(|shape| shape.surface == Surface::Material(*number))
    };
    let kept: Vec<usize> = (0..recipe.materials.len()).filter(used).collect();
    (kept.len() < recipe.materials.len()).then(|| {
        let mut simpler = recipe.clone();
        simpler.materials = kept.iter().map(|&number| recipe.materials[number].clone()).collect();
        for shape in &mut simpler.shapes {
            if let Surface::Material(number) = &mut shape.surface {
                *number = kept.iter().position(|kept| kept == number).unwrap_or(0);
            }
        }
        simpler
    })
}

#[cfg(test)]
mod tests {
    use super::super::draw::{Kind, recipe};
    use super::*;

    /// The failure needs a sphere of a certain radius together with a smooth mesh; everything else is removed.
    #[test]
    fn what_has_no_part_in_the_failure_goes() {
        let guilty = |recipe: &Recipe| {
            let round = |shape: &Shape| matches!(shape.body, Body::Sphere { radius, .. } if radius < 0.9);
            let smooth = |shape: &Shape| matches!(shape.body, Body::Mesh { smooth: true, .. });
            recipe.shapes.iter().any(round) && recipe.shapes.iter().any(smooth)
        };
        let mut shrunk = 0;
        for number in 0..200 {
            let large = recipe(Kind::Ordinary, 5, number);
            if !guilty(&large) {
                continue;
            }
            let small = shrink(&large, guilty);
            assert!(guilty(&small) && small.shapes.len() == 2, "{small:?}");
            assert_eq!(
                (small.size(), small.film, &small.sky, &small.lens),
                (2, [1, 1], &None, &None),
                "{small:?}"
            );
            assert!(small.materials.len() <= 2);
            shrunk += 1;
        }
        assert!(shrunk > 20, "{shrunk}");
    }
}
