"""OpenDRIVE file with every kind of geometry: line, arc, spiral, poly3 and paramPoly3, with heights and crossfall."""

from tests.maps.opendrive_text import geometry, opendrive, road

SHAPES = (
    "<line/>",
    '<arc curvature="0.0173"/>',
    '<spiral curvStart="-0.011" curvEnd="0.027"/>',
    '<poly3 a="0" b="0.01" c="0.0031" d="-0.00002"/>',
    '<paramPoly3 pRange="arcLength" aU="0" bU="1" cU="0.0003" dU="-0.000021" aV="0" bV="0" cV="0.0041" dV="0.000013"/>',
    '<paramPoly3 pRange="normalized" aU="0" bU="71" cU="2.1" dU="-3.7" aV="0" bV="0" cV="17.3" dV="-5.1"/>',
)


def curved_map() -> str:
    profile = '<elevation s="0" a="0.3" b="0.013" c="-0.00021" d="0.0000017"/>'
    return opendrive(
        *(
            road(
                k,
                length=73.1,
                plan=geometry(shape, 73.1, x=200.3 * k, y=-17.7 * k, hdg=0.37 * k),
                profile=profile,
                more='<lateralProfile><superelevation s="0" a="0.02" b="0.0004" c="0" d="0"/></lateralProfile>',
            )
            for k, shape in enumerate(SHAPES, 1)
        )
    )
