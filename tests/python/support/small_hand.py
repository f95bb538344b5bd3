"""A small hand of three fingers as MJCF, which needs no package but MuJoCo."""

FINGER = """
<body name="{name}" pos="{x} {y} 0" euler="0 0 {turn}">
  <joint name="{name}_base" axis="0 1 0" range="-1.2 1.2" actuatorfrcrange="-2 2"/>
  <geom type="capsule" size="0.008" fromto="0 0 0.004 0 0 0.05" mass="0.02"/>
  <body name="{name}_end" pos="0 0 0.055">
    <joint name="{name}_bend" axis="0 1 0" range="-1.6 1.6" actuatorfrcrange="-2 2"/>
    <joint name="{name}_side" axis="1 0 0" range="-0.6 0.6" actuatorfrcrange="-2 2"/>
    <geom name="{name}_tip" type="sphere" size="0.01" pos="0 0 0.045" mass="0.01"/>
    <site name="{name}_site" pos="0 0 0.05"/>
  </body>
</body>"""

PI = 3.14159265
PLACES = {"thumb": (-0.05, 0, 0), "left": (0.05, 0.03, PI), "right": (0.05, -0.03, PI)}


def mjcf(extra="", **replaced):
    """Return the MJCF text of the small hand; `replaced` are texts that take the place of others."""
    fingers = "".join(FINGER.format(name=n, x=x, y=y, turn=t) for n, (x, y, t) in PLACES.items())
    palm = '<geom type="box" size="0.06 0.05 0.005" pos="0 0 -0.02" mass="0.3"/>'
    text = (
        '<mujoco><compiler angle="radian"/><worldbody><geom type="plane" size="1 1 1"/>'
        f'<body name="palm" pos="0 0 1">{palm}{fingers}'
        f"</body></worldbody>{extra}</mujoco>"
    )
    for old, new in replaced.items():
        text = text.replace(old, new)
    return text


TIPS = tuple(f"{name}_tip" for name in PLACES)
