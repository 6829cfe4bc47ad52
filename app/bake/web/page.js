// Shows a bake as the viewer does: light from the lightmap alone, the same camera, exposure and tone curve.
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

const TONE_MAPS = {
  clamp: THREE.LinearToneMapping,
  reinhard: THREE.ReinhardToneMapping,
  aces: THREE.ACESFilmicToneMapping,
  agx: THREE.AgXToneMapping,
  neutral: THREE.NeutralToneMapping,
};

// What the page brings along as base64: its name is the id of its element.
function held(name) {
  const element = document.getElementById(name);
  return element && Uint8Array.from(atob(element.textContent), (letter) => letter.charCodeAt(0)).buffer;
}

function picture(name) {
  const data = new EXRLoader().parse(held(name));
  const texture = new THREE.DataTexture(data.data, data.width, data.height, data.format, data.type);
  texture.minFilter = texture.magFilter = THREE.LinearFilter;
  texture.flipY = true; // the loader turns the rows over, glTF counts V from the top
  texture.needsUpdate = true;
  return texture;
}

// The light of a lightmap on a mesh. What no light falls on has no second texture coordinates.
const lightMaps = {};
function light(mesh) {
  const material = mesh.material, name = material.userData.lightmap;
  if (material.transmission) {
    Object.assign(material, { opacity: 1 - material.transmission, transparent: true, transmission: 0 });
  }
  if (!name || !mesh.geometry.attributes.uv1) return;
  lightMaps[name] ??= Object.assign(picture(name), { channel: 1 });
  Object.assign(material, { lightMap: lightMaps[name], metalness: 0 }); // metals reflect diffusely in a bake
}

const about = JSON.parse(document.getElementById('about').textContent);
const renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
renderer.setPixelRatio(devicePixelRatio);
renderer.toneMapping = TONE_MAPS[about.tone_map];
renderer.toneMappingExposure = 2 ** about.exposure;

const gltf = await new GLTFLoader().parseAsync(held('scene.glb'), '');
gltf.scene.traverse((object) => {
  if (object.isLight) object.visible = false; // its light is in the map
  if (object.isMesh) light(object);
});
const scene = new THREE.Scene();
scene.add(gltf.scene);
if (document.getElementById('sky.exr')) {
  scene.background = Object.assign(picture('sky.exr'), { mapping: THREE.EquirectangularReflectionMapping, flipY: false });
}

const bounds = new THREE.Box3().setFromObject(gltf.scene).getBoundingSphere(new THREE.Sphere());
const camera = new THREE.PerspectiveCamera(
  THREE.MathUtils.radToDeg(about.camera.yfov), 1, 1e-3 * bounds.radius, 10 * bounds.radius);
new THREE.Matrix4().set(...about.camera.world_from_camera.flat()).decompose(camera.position, camera.quaternion, camera.scale);
const ahead = camera.getWorldDirection(new THREE.Vector3()); // before the controls turn it to their target
const distance = Math.max(bounds.center.clone().sub(camera.position).dot(ahead), 0.1 * bounds.radius);
const target = camera.position.clone().addScaledVector(ahead, distance);
const controls = new OrbitControls(camera, renderer.domElement);
controls.target.copy(target);
controls.update();

// The sun's disc, which is not in the map of the sky: behind all else, wherever the camera goes.
const sun = about.sun && new THREE.Vector3(...about.sun.towards);
const disc = sun && new THREE.Mesh(
  new THREE.CircleGeometry(Math.tan(about.sun.angle / 2), 32),
  new THREE.MeshBasicMaterial({ color: new THREE.Color(...about.sun.radiance) }));
if (disc) scene.add(disc);

function draw() {
  if (disc) {
    disc.scale.setScalar(0.95 * camera.far);
    disc.position.copy(camera.position).addScaledVector(sun, 0.95 * camera.far);
    disc.lookAt(camera.position);
  }
  renderer.render(scene, camera);
}
function resize() {
  renderer.setSize(innerWidth, innerHeight);
  camera.aspect = innerWidth / innerHeight;
  camera.updateProjectionMatrix();
  draw();
}
addEventListener('resize', resize);
controls.addEventListener('change', draw);
document.getElementById('say').remove();
document.body.append(renderer.domElement);
resize();
