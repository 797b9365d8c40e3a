/* SPDX-License-Identifier: MIT */
/* newer.h - words of MJCF that came after MuJoCo 2.2, and what to write instead. */
#ifndef NEWER_H
#define NEWER_H

/* A hint to put behind an error message of mj_loadXML: "" if the message is not about a word that MuJoCo 2.2 does not know. The
   text stands in static memory until the next call. */
const char *newer_hint(const char *error);

#endif
