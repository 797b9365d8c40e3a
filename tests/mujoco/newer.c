/* SPDX-License-Identifier: MIT */
/* newer.c - what to write for words of MJCF that came after MuJoCo 2.2. The list is not complete: of other words the hint says that
   MuJoCo 2.2 does not know them. */
#include <stdio.h>
#include <string.h>

#include <mujoco/mujoco.h>

#include "newer.h"

#define FORCE "forcerange and forcelimited=\"true\" at the actuator of this joint"
#define BODIES "bodies on hinges and sliders, or <composite>"
#define TEXT "the text of that model. MuJoCo 3 writes it: mj_saveLastXML"
#define NONE "" /* the motion does not depend on it */

static const struct {
    const char *word, *instead;
} words[] = {
    /* option, compiler, size */
    {"implicitfast", "implicit. MuJoCo 2.2 has Euler, RK4, implicit"},
    {"eulerdamp", "nothing, remove it: Euler of MuJoCo 2.2 is always implicit in joint damping"},
    {"actuatorgroupdisable", "nothing, and remove the actuators of these groups"},
    {"spring", "passive=\"disable\", which removes springs and dampers"},
    {"damper", "passive=\"disable\", which removes springs and dampers"},
    {"ccd_iterations", "mpr_iterations"},
    {"ccd_tolerance", "mpr_tolerance"},
    {"ls_iterations", NONE},
    {"ls_tolerance", NONE},
    {"sdf_iterations", NONE},
    {"sdf_initpoints", NONE},
    {"o_friction", NONE},
    {"midphase", NONE},
    {"nativeccd", NONE},
    {"island", NONE},
    {"invdiscrete", NONE},
    {"autoreset", NONE},
    {"sleep", NONE},
    {"sleep_tolerance", NONE},
    {"memory", NONE},
    {"interval", "inteval, the spelling of MuJoCo 2.2"},
    {"assetdir", "meshdir and texturedir"},
    {"alignfree", NONE},
    {"saveinertial", NONE},
    {"bvactive", NONE},
    {"ellipsoidinertia", NONE},
    {"actuatorfrc", NONE},
    /* joints, bodies */
    {"actuatorfrcrange", FORCE},
    {"actuatorfrclimited", FORCE},
    {"actuatorforcerange", FORCE},
    {"actuatorforcelimited", FORCE},
    {"gravcomp", "nothing, remove it: gravity then acts on this body"},
    {"actuatorgravcomp", "nothing, remove it"},
    {"frame", "its children, each with the pose of the frame"},
    {"replicate", "copies of the subtree"},
    {"attach", TEXT},
    {"model", TEXT},
    {"childclass", "childclass at a body or class at each element"},
    {"align", NONE},
    /* deformable bodies, plugins */
    {"flex", BODIES},
    {"flexcomp", BODIES},
    {"deformable", BODIES},
    {"plugin", BODIES},
    {"extension", BODIES},
    {"cable", BODIES},
    {"curve", BODIES},
    {"sdf", "mesh"},
    {"octree_depth", NONE},
    {"maxhullvert", NONE},
    /* meshes: the attribute inertia */
    {"inertia", "exactmeshinertia=\"true\" in <compiler>, or nothing"},
    /* actuators */
    {"kv", "<general gainprm=\"KP\" biastype=\"affine\" biasprm=\"0 -KP -KV\"/> for this <position>"},
    {"dampratio", "<general gainprm=\"KP\" biastype=\"affine\" biasprm=\"0 -KP -KV\"/>, KV = 2 dampratio sqrt(KP inertia)"},
    {"timeconst", "<general dyntype=\"filter\" dynprm=\"T\" ../> for this actuator"},
    {"inheritrange", "ctrllimited=\"true\" and ctrlrange with the range of the joint"},
    {"filterexact", "filter"},
    {"dcmotor", "<motor>, and damping and armature at the joint"},
    {"pid", "<position>"},
    {"actearly", "nothing, remove it: the force comes one step later"},
    {"actdim", "nothing, remove it"},
    {"delay", "nothing, remove it"},
    {"nsample", "nothing, remove it"},
    /* equalities, tendons */
    {"site1", "body1, body2 and anchor"},
    {"site2", "body1, body2 and anchor"},
    {"armature", "armature at the joints"},
    /* what is seen or measured */
    {"bulbradius", NONE},
    {"intensity", NONE},
    {"texture", NONE},
    {"metallic", NONE},
    {"roughness", NONE},
    {"layer", NONE},
    {"resolution", NONE},
    {"focal", NONE},
    {"focalpixel", NONE},
    {"principal", NONE},
    {"principalpixel", NONE},
    {"sensorsize", NONE},
    {"projection", NONE},
    {"orthographic", NONE},
    {"output", NONE},
    {"colorspace", NONE},
    {"nchannel", NONE},
    {"content_type", NONE},
    {"camprojection", NONE},
    {"distance", NONE},
    {"normal", NONE},
    {"fromto", NONE},
    {"contact", NONE},
    {"insidesite", NONE},
    {"tactile", NONE},
    {"e_potential", NONE},
    {"e_kinetic", NONE},
    {"tendonactuatorfrc", NONE},
    {"jointactuatorfrc", NONE},
    {"reduce", NONE},
    {"zsensor", NONE},
    {"fixframe", NONE}};

const char *newer_hint(const char *error)
{
    static char hint[500];
    const char *from = NULL, *end;
    char text[80] = "";
    if (strstr(error, "autolimits")) return "\nhint: add <compiler autolimits=\"true\"/>, which is the default of newer versions";
    if (strstr(error, "unrecognized attribute") || strstr(error, "invalid keyword")) from = strchr(error, '\'');
    else if (strstr(error, "unrecognized element") && (from = strstr(error, "Element '"))) from += 8;
    if (!from || !(end = strchr(from + 1, '\'')) || end - from > (int)sizeof text) return "";
    memcpy(text, from + 1, (size_t)(end - from - 1));
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (strcmp(words[i].word, text) == 0) {
            snprintf(hint, sizeof hint, "\nhint: in place of %s write %s", text,
                     *words[i].instead ? words[i].instead : "nothing, remove it: the motion does not depend on it");
            return hint;
        }
    snprintf(hint, sizeof hint,
             "\nhint: MuJoCo %s does not know %s. Possible cause: a model for a newer version. Remove it, or "
             "write what it means in other words",
             mj_versionString(), text);
    return hint;
}
