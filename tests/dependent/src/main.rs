//! Renders a sphere under a lamp into a picture, and says how bright it is.

use octolux::scene::{Camera, FilmSize, Fov, Material, Scene, Sphere, Surface};
use octolux::{RenderOptions, render};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let camera = Camera::new([0.0, 1.0, 4.0], [0.0; 3], Fov::X(40.0));
    let mut scene = Scene::builder(camera, FilmSize { width: 48, height: 32 });
    let grey = scene.material(Material::diffuse("grey", [0.5; 3]));
    scene.sphere(Sphere::new([0.0; 3], 1.0, Surface::Material(grey)));
    scene.sphere(Sphere::new([2.0, 4.0, 2.0], 0.5, Surface::emission([9.0; 3])));
    let picture = render(&scene.build()?, &RenderOptions { spp: 16, ..Default::default() })?;
    octolux::film::write_picture("dependent.exr".as_ref(), &picture, &Default::default())?;
    let brightest = picture.pixels.iter().flatten().copied().fold(0.0, f32::max);
    assert!(brightest > 0.1 && brightest < 9.1, "{brightest}");
    println!("{} x {} pixels, the brightest {brightest}", picture.width, picture.height);
    Ok(())
}
