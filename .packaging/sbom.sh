#!/bin/sh
# SPDX-License-Identifier: MIT
# sbom.sh VERSION TIME FILE.. - the bill of materials of what dist.sh has made, SPDX 2.3 in JSON: roln, file by file, and the
# archives that hold it. It depends on nothing.
version=$1 time=$2
shift 2
rights='"licenseConcluded": "MIT", "copyrightText": "Copyright (c) 2026 the roln authors"'
sum() { "$1sum" < "$2" | cut -d ' ' -f 1; }
id() { echo "$1" | sed "s/-$version.*//; s/_/-/g; s/^/SPDXRef-/"; }
relation() { printf '%s    { "spdxElementId": "%s", "relationshipType": "%s", "relatedSpdxElement": "%s" }' "$@"; }

# the verification code of SPDX: SHA-1 of the sorted SHA-1 sums
code=$(for f in "$@"; do sum sha1 "$f"; done | LC_ALL=C sort | tr -d '\n' | sha1sum | cut -d ' ' -f 1)
cat << end
{
  "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": "roln-$version",
  "documentNamespace": "https://spdx.org/spdxdocs/roln-$version-$code",
  "creationInfo": { "created": "$(TZ=UTC date -d "@$time" +%Y-%m-%dT%H:%M:%SZ)", "creators": ["Tool: sbom.sh"] },
  "packages": [
    { "SPDXID": "SPDXRef-roln", "name": "roln", "versionInfo": "$version", "downloadLocation": "NOASSERTION",
      "licenseDeclared": "MIT", $rights,
      "filesAnalyzed": true, "packageVerificationCode": { "packageVerificationCodeValue": "$code" } }
end
cd build/dist || exit 1
for f in roln-*-"$version".*; do
    cat << end
    ,
    { "SPDXID": "$(id "$f")", "name": "${f%-"$version"*}", "versionInfo": "$version", "downloadLocation": "NOASSERTION",
      "licenseDeclared": "MIT", $rights,
      "filesAnalyzed": false, "packageFileName": "$f",
      "checksums": [{ "algorithm": "SHA256", "checksumValue": "$(sum sha256 "$f")" }] }
end
done
printf '  ],\n  "files": ['
comma=
for f in "$@"; do
    cat << end
$comma
    { "SPDXID": "$(id "$f")", "fileName": "./$f", $rights,
      "checksums": [{ "algorithm": "SHA1", "checksumValue": "$(sum sha1 "../../$f")" },
                    { "algorithm": "SHA256", "checksumValue": "$(sum sha256 "../../$f")" }] }
end
    comma=,
done
printf '  ],\n  "relationships": [\n'
relation '' SPDXRef-DOCUMENT DESCRIBES SPDXRef-roln
for f in "$@"; do relation ',
' SPDXRef-roln CONTAINS "$(id "$f")"; done
for f in roln-*-"$version".*; do relation ',
' "$(id "$f")" CONTAINS SPDXRef-roln; done
printf '\n  ]\n}\n'
