// The camera: orbit about the target, pan across the view, dolly towards the target.

const add = (a, b, s = 1) => a.map((x, i) => x + s * b[i]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = a => Math.hypot(...a);
const unit = a => a.map(x => x / length(a));
/** Turns a vector about a unit axis (Rodrigues). */
const turn = (v, axis, angle) => add(add(v.map(x => x * Math.cos(angle)), cross(axis, v), Math.sin(angle)), axis, dot(axis, v) * (1 - Math.cos(angle)));

export class Camera {
  /** Calls `moved(view)` for every new view, at most once a frame of the screen. */
  constructor(moved) { this.moved = moved; this.busy = this.more = false; this.sent = -1e9; }
  /** What the server looks at; a view of one's own that is on its way counts more. */
  take(told) {
    this.told = told;
    // What the server tells may be older than what was just sent.
    if (performance.now() - this.sent > 600) this.view = { origin: told.origin, target: told.target, up: told.up, focus: told.focus };
  }
  get ready() { return Boolean(this.view); }
  axes() {
    const { origin, target, up } = this.view, back = add(origin, target, -1), forward = unit(back.map(x => -x));
    const right = unit(cross(forward, up));
    return { back, forward, right, up: cross(right, forward), distance: length(back) };
  }
  send() {
    this.sent = performance.now();
    // The first view goes at once; those that come before the next frame of the screen wait for it, and the last one goes.
    if (this.busy) { this.more = true; return; }
    this.busy = true;
    this.moved(this.view);
    requestAnimationFrame(() => {
      this.busy = false;
      if (this.more) { this.more = false; this.send(); }
    });
  }
  /** Turns about the target; full angles in radians. */
  orbit(yaw, pitch) {
    if (!this.ready) return;
    const { back, right } = this.axes(), axis = unit(this.view.up);
    // Never over the poles, where left and right would change places.
    const height = Math.asin(Math.max(-1, Math.min(1, dot(unit(back), axis))));
    const most = 89 * Math.PI / 180;
    const change = Math.max(-most, Math.min(most, height + pitch)) - height;
    this.view.origin = add(this.view.target, turn(turn(back, right, -change), axis, -yaw));
    this.send();
  }
  /** Moves across the view, in heights of the picture at the target. */
  pan(dx, dy, aspect) {
    if (!this.ready) return;
    const { right, up, distance } = this.axes(), fov = this.told.fov;
    const half = fov.y ? Math.tan(fov.y * Math.PI / 360) : Math.tan(fov.x * Math.PI / 360) / aspect;
    const step = add(right.map(x => -x * dx), up, dy).map(x => 2 * half * distance * x);
    this.view.origin = add(this.view.origin, step);
    this.view.target = add(this.view.target, step);
    this.send();
  }
  /** Goes towards the target: its distance is multiplied by the factor. */
  dolly(factor) {
    if (!this.ready) return;
    const { back } = this.axes();
    this.view.origin = add(this.view.target, back, factor);
    this.send();
  }
}
