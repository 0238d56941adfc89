# Copyright 2026 The geomsrv authors
# SPDX-License-Identifier: Apache-2.0
"""The cases of `geomsrv.selfcheck`: inputs as they stand, answers from exact rational arithmetic, rounded once.

A case is a line "query: what is hard about it" and its numbers, as hex floats: a frustum by origin, axes by rows,
half widths, near and far; a box by centre, axes by rows, half extents; polygons by their vertices.  ``meets`` is 1
for a common point; ``contact`` lists the points of the contact set; ``size`` is the extent of the scene.
"""

CASES = """
cull: only one of the 26 axes separates
  frustum 0x1.cf5128fd6a4cep+0 0x1.640a7ffc6fe56p+0 -0x1.ec392f86c8798p-1 -0x1.70af64c92f26ap-3
    0x1.610087e472b06p-1 0x1.6737f51543cd2p-1 0x1.67f50f6bb2186p-1 -0x1.a27b9ca1e8f6ap-2 0x1.29fb2f5daccacp-1
    0x1.603fb1b4f6508p-1 0x1.323052f46d2b9p-1 -0x1.a5039c49b3dep-2 0x1.90a1d3e42bd6bp-2 0x1.adc842b5b390ep-2
    0x1.47dda92bf645cp+0 0x1.ce17ff3357c9ap+2
  box 0x1.37cec1d7b33f6p+2 0x1.00b0414d0130bp+1 -0x1.4292b6945d829p+2 -0x1.52d00f1a5c7d8p-9
    -0x1.a42b7571fc4c4p-3 -0x1.f51b6b7591b0ap-1 -0x1.3f03156c37f76p-2 -0x1.dc160dc78909p-1 0x1.90e00e0e2a90fp-3
    -0x1.e684b0b63bf5dp-1 0x1.38be3d7c7c0f7p-2 -0x1.f7e676a300db6p-5 0x1.a673da2b2b7c7p+0 0x1.75631a95383e6p-2
    0x1.11eb12585da33p+0
  meets 0
  size 0x1.75310a0fc0f7cp+2
cull: all but overlapping along one axis
  frustum 0x1.358a385ac0bp-3 0x1.e8aedda0abe9ep+0 -0x1.91a12691224c6p+0 0x1.b76120933a649p-3
    -0x1.76cf4f86929c5p-1 -0x1.4b0d6c9f36648p-1 -0x1.c515a4e7abe96p-1 -0x1.b4148642871a3p-2 0x1.8218bd4087e06p-3
    -0x1.a748e770d3973p-2 0x1.104007ff9695fp-1 -0x1.7a758e6d58a5bp-1 0x1.dae96448b2802p+0 0x1.3ca11fd86ccf1p+0
    0x1.f16dfecae4b1p+0 0x1.9168ebb976496p+1
  box -0x1.834dd8f30c521p+1 0x1.659497ce32a9bp-1 -0x1.b651297521454p+2 -0x1.3b47ed5080c76p-2
    0x1.e69b4a1ec75a5p-1 -0x1.687149defdb7bp-5 -0x1.7d6cbae5a3084p-3 -0x1.b05c9a5a861p-4 -0x1.f4215b1801071p-1
    -0x1.ddb41b86720b6p-1 -0x1.2b94a133f370fp-2 0x1.ad1152976f97ap-3 0x1.1786ab35fd07cp+0 0x1.80d670b4f77c7p+0
    0x1.12e612b9a4ed2p-1
  meets 1
  size 0x1.ba2999acc15eep+2
cull: only one of the 26 axes separates
  frustum -0x1.98bd8041b6b58p-2 -0x1.bbbdac3ed2a2p-3 -0x1.c09656052028p+0 -0x1.1a8c8c598b746p-1
    0x1.494bffc7c8aecp-1 -0x1.0fcc09ec07f93p-1 -0x1.5ac9a3a3a61b1p-2 -0x1.82539ca977b69p-1 -0x1.1fcd76a9b85p-1
    -0x1.862f7558c1c1bp-1 -0x1.0b1cd3604d37p-3 0x1.44b71fc40a5f9p-1 0x1.fc90cd5fd7f48p-1 0x1.d1da2ff22239ap-1
    0x1.03ccb0f7e12fdp-1 0x1.c8b2dc35a13a8p+0
  box -0x1.c700ff83514a4p+1 -0x1.99504fea8dfb7p+2 -0x1.4cb75569e9721p+1 0x1.9c51cba0538c2p-1
    -0x1.cff5a7b307bdap-7 -0x1.2f741cc71de07p-1 0x1.0f2048ee113e6p-4 -0x1.fb8dd7e5239cep-1 0x1.d16572858f9ep-4
    -0x1.2da469326ebefp-1 -0x1.0bbd89c1151fap-3 -0x1.984261a2dca58p-1 0x1.0612caa52b9a7p+0 0x1.150d03a1ed8f3p+1
    0x1.12d15af569a4ap+1
  meets 0
  size 0x1.13d496b525013p+3
cull: only one of the 26 axes separates
  frustum -0x1.7e3edcffa67p-5 -0x1.33f5a1a0ea4p-5 0x1.5360c960d59bap+0 -0x1.0ad27b8a802e4p-4
    0x1.fd5231678e194p-1 0x1.425b0fae42b82p-4 -0x1.43bb665bd5666p-2 0x1.bc42ac17ebebbp-5 -0x1.e4f21fd01c2cp-1
    -0x1.e497f8161d42ap-1 -0x1.62a25e65d3c14p-4 0x1.3e6bb06accdfap-2 0x1.3e5766079d22ap+0 0x1.41f42b4b49acp-1
    0x1.75a25c873a53cp+0 0x1.16426cd77df2fp+3
  box -0x1.849d31e8a2d69p+1 0x1.3f3e8ba1a2332p+2 -0x1.099d388ce6e75p-2 0x1.7119b7bdbde8fp-2 0x1.fc8fff0137cd3p-2
    0x1.944298a9f2db7p-1 -0x1.2d69c39d3ac41p-1 0x1.8e30cc3b7be91p-1 -0x1.c3750c7bc8431p-3 -0x1.7273ef79a18b1p-1
    -0x1.8a9c2f88f6aeap-2 0x1.2538f05bf04edp-1 0x1.ae256dd31ad0ep+0 0x1.63fa682472718p+0 0x1.3c868a4935e49p+1
  meets 0
  size 0x1.f94225481b748p+2
cull: all but overlapping along one axis
  frustum -0x1.897d1149b9a3ep+0 0x1.236cc8d55d27cp+0 0x1.141a28a6c52cp-3 0x1.16a62559bc87ap-2
    -0x1.daea9a1edad54p-1 -0x1.0632f34fbba45p-2 0x1.b9ac346a67a2ap-2 0x1.6bf9038d60ec4p-2 -0x1.a890e49f670a5p-1
    0x1.b869d6f3bdb06p-1 0x1.d7e3a34712359p-4 0x1.fcb9f5c97a38p-2 0x1.d9283aeafd65p-1 0x1.b2bac34f715bcp-1
    0x1.60211b01eae88p+0 0x1.5511280e974d4p+2
  box 0x1.0cc07e2a578aep+0 0x1.bfc7453d3fa5fp+1 -0x1.bd5dce4f36df5p+0 -0x1.81e9360fff18ep-1 0x1.240781040b8fcp-2
    0x1.2f24ed674074bp-1 0x1.00d7d79a779e2p-1 -0x1.5450c40f53e06p-2 0x1.98ed845a5435ap-1 0x1.b2bbcb46c541dp-2
    0x1.cc4b1fa742cb9p-1 0x1.b80b85efc8095p-4 0x1.f606f02a87be6p+0 0x1.69782019f8c45p+0 0x1.1cca832157cc5p+0
  meets 1
  size 0x1.4fb7bce10837dp+2
cull: edges cross at a tiny angle, only their cross product decides
  frustum 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1.604189374bc6bp-5 0x1.f3b645a1cac08p-5 0x1.999999999999ap-4
    0x1.999999999999ap-3
  box 0x1.32f3cce23cbbcp-4 0x1.9e853cd46ada7p-4 0x1.1de30c40568cfp-3 -0x1.8da0f5583bf1dp-4 0x1.bc4126b9f8f52p-1
    -0x1.f33ed31f2953bp-2 0x1.de0fc5a1f90fep-1 -0x1.718273bec2b78p-4 -0x1.62c86305e2b23p-2 0x1.60e0aa846ff37p-2
    0x1.f49805540486ap-2 0x1.9a52a3498d1fbp-1 0x1.98e0e34fa5ffep-7 0x1.98e0e34fa5ffep-7 0x1.7f52d51aab9fep-2
  meets 0
  size 0x1.ccccccc070d79p-2
cull: edges cross at a tiny angle, only their cross product decides
  frustum 0x1.de02733bd2764p-2 -0x1.654c0bb7585acp-1 -0x1.062f14d70e1e4p-2 -0x1.6f5da105217d3p-1
    -0x1.621241b7d4fb8p-1 -0x1.5548b31b3d678p-4 0x1.6406af001aad4p-1 -0x1.688a205c5c5f5p-1 -0x1.25f4c6c306a5fp-3
    0x1.4c7c82d8b9206p-5 -0x1.499336660ad0ep-3 0x1.f8e6419a083ffp-1 0x1.420c49ba5e354p-1 0x1.ec8b439581062p-2
    0x1.7ae147ae147aep-2 0x1.28p+4
  box -0x1.138fb5ce82e12p+1 -0x1.7a41f4c040935p+4 0x1.18441bfdd00e1p-3 0x1.6631b93fe9643p-1
    -0x1.1c7bcf8e4a5a6p-2 -0x1.510edf0dd8108p-1 -0x1.68f2682be2544p-1 -0x1.e3ed2d5d96bdp-4 -0x1.660da7d6fcf5bp-1
    -0x1.dd34f7712c22ap-4 -0x1.e81c5ba79681ep-1 0x1.1d3133d7679aap-2 0x1.12175000a389ap+2 0x1.12175000a389ap+2
    0x1.00f5db009951p+7
  meets 1
  size 0x1.263fbf8912036p+7
cull: edges cross at a tiny angle, only their cross product decides
  frustum 0x1.3f490b978b798p-2 0x1.43e77b6381954p-1 -0x1.cfcee64d036f8p-1 0x1.9954e33398c1dp-1
    -0x1.18836e97532a4p-1 0x1.f8713a4b741fcp-3 -0x1.0cebba27a10e7p-1 -0x1.c1210a7b19087p-2 0x1.755bb50adbc4cp-1
    -0x1.2a7c06ebe44d9p-2 -0x1.6cba89d1a49b8p-1 -0x1.46dea00028ba9p-1 0x1.5c28f5c28f5c3p-3 0x1.f3b645a1cac08p-5
    0x1.999999999999ap-4 0x1.999999999999ap-3
  box -0x1.8d8e56309ef8ep-2 -0x1.10e4273497666p-2 -0x1.446af611dd748p-1 -0x1.b0d31a575e696p-2
    -0x1.9bdf0d8542cedp-1 -0x1.ab6b41a959858p-2 -0x1.b511b3a25a382p-2 -0x1.d634538a8ecb2p-3 0x1.bfd93e9e6903bp-1
    0x1.9954e33399954p-1 -0x1.18836e97c5b79p-1 0x1.f8713a476e301p-3 0x1.5c28f5c28f5c3p-1 0x1.5c28f5c28f5c3p-1
    0x1.051eb851eb852p+1
  meets 0
  size 0x1.744e24cdaed8dp+1
cull: frames nearly equal, cross products are noise
  frustum 0x1.0299da19b773ep+2 -0x1.68e9b49b3a66p+1 0x1.1266fcc88f4b4p+0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0
    0x1.8p-1 0x1p-1 0x1p+0 0x1.8p+1
  box 0x1.090040801dda4p+2 -0x1.5c1ce7ce6d993p+1 0x1.89337e6447a5ap+1 0x1p+0 0x1.152ed250f5b26p-38
    -0x1.c9a66c15fe3d7p-38 -0x1.152ed250f5aadp-38 0x1p+0 0x1.0e322c228a3e3p-46 0x1.c9a66c15fe421p-38
    -0x1.0e322c1acc2b1p-46 0x1p+0 0x1p-2 0x1p-1 0x1.999999999999ap-2
  meets 1
  size 0x1.3333333334191p+1
cull: far over near is huge
  frustum 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1.92a737110e454p-21 0x1.0c6f7a0b5ed8dp-21
    0x1.0c6f7a0b5ed8dp-20 0x1.e848p+19
  box 0 0 0x1.0c6f7a0b5ed8dp-21 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1.ad7f29abcaf48p-24 0x1.ad7f29abcaf48p-24
    0x1.0c6f7a0b5ed8dp-22
  meets 0
  size 0x1.0c6f7a0b5ed8dp-20
cull: far over near multiplies rounding at the near plane
  frustum 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1.080a186953077p-21 0x1.3e6ba8e5780e6p-21
    0x1.0c6f7a0b5ed8dp-20 0x1.e848p+19
  box -0x1.a8e79463f0c29p-21 0x1.036f538a2077ep-20 0x1.7515eabd5fa61p-20 -0x1.e86d1b331757ap-1
    0x1.d809c62567d12p-3 -0x1.8917a21128258p-3 0x1.32285dfae08edp-2 0x1.5beeba33fa526p-1 -0x1.5701cccf08bc1p-1
    0x1.88db3e6a13cd4p-6 0x1.6498930bcb4bbp-1 0x1.6f3210229aa5dp-1 0x1.ad7f29abcaf48p-24 0x1.ad7f29abcaf48p-24
    0x1.0c6f7a0b5ed8dp-22
  meets 0
  size 0x1.bc59b77c6db5dp-20
cull: far over near multiplies rounding at the near plane
  frustum 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1.915fff53347e8p-16 0x1.195ee3d4350b2p-16
    0x1.09456549be1bdp-15 0x1.ee1b1b3d78c7bp+14
  box 0x1.0360ff88d89ccp-14 -0x1.7ba3f799688d3p-15 0x1.41e91173fd9ap-14 0x1.d464a1044dc1dp-1
    -0x1.131ab73b61c25p-2 -0x1.34bf7761184bap-2 -0x1.9a84be41ab54cp-2 -0x1.63632a13660eep-1
    -0x1.321ff9dddc6b3p-1 0x1.8e933e442fb44p-5 -0x1.55f0bc9545395p-1 0x1.7c436b8d9df07p-1 0x1.a86f0875fcf95p-19
    0x1.a86f0875fcf95p-19 0x1.09456549be1bdp-17
  meets 0
  size 0x1.66778c6088697p-14
cull: millimetres, far from the origin
  frustum -0x1.5af92aee396d3p+29 -0x1.328d6451479c1p+29 0x1.2d3eba7f5b5d1p+29 -0x1.ffdb64793befep-2
    -0x1.b492046af11adp-3 0x1.adce208d6d47dp-1 0x1.8f73ca8c94006p-2 0x1.9eb236d506469p-1 0x1.c07771641be8bp-2
    -0x1.8bebfa92e37fcp-1 0x1.17bf834a69b32p-1 -0x1.496deed85c8f2p-2 0x1.0624dd2f1a9fcp-10 0x1.0624dd2f1a9fcp-11
    0x1.0624dd2f1a9fcp-10 0x1.47ae147ae147bp-7
  box -0x1.5af92aee5e615p+29 -0x1.328d645146526p+29 0x1.2d3eba7f60ab6p+29 -0x1.94c78ef2f0f37p-2
    -0x1.0119f30b89395p-1 -0x1.89cdb8782895dp-1 0x1.8710f48e725a7p-1 0x1.244bdbbcba37p-2 -0x1.2865f327826f2p-1
    0x1.053f08279ee46p-1 -0x1.a1f3a1062d1d3p-1 0x1.1534c5345321p-2 0x1.0624dd2f1a9fcp-10 0x1.0624dd2f1a9fcp-9
    0x1.89374bc6a7efap-9
  meets 1
  size 0x1.603697d776966p-6
cull: the box holds the frustum
  frustum 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p+0 0x1p+0 0x1p+0 0x1p+1
  box 0 0 0x1.8p+0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1.9p+6 0x1.9p+6 0x1.9p+6
  meets 1
  size 0x1.96p+6
cull: top and bottom of the printed frustum take ell for mu: erratum of the paper
  frustum -0x1.8p+1 -0x1.8p+1 0x1p+0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p+1 0x1p+2 0x1p+1 0x1.4p+3
  box -0x1.d555555555555p+0 0x1.a666666666666p+2 -0x1.bbbbbbbbbbbbcp+0 0x1.5555555555555p-1 0x1.5555555555555p-2
    -0x1.5555555555555p-1 0x1.5555555555555p-2 0x1.5555555555555p-1 0x1.5555555555555p-1 0x1.5555555555555p-1
    -0x1.5555555555555p-1 0x1.5555555555555p-2 0x1p+2 0x1.4p+2 0x1p+0
  meets 0
  size 0x1p+4
distance_to_frustum: where the printed region tests err
  frustum 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p+0 0x1p-1 0x1p+0 0x1p+2
  point 0x1.8p+1 0x1.8p+0 0x1p+1
  distance 0x1.7d9f4cf754635p-1
  size 0x1.8p+1
distance_to_frustum: where the printed region tests err
  frustum 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p+0 0x1p-1 0x1p+0 0x1p+2
  point 0x1.4p+5 0x1.4p+1 0x1p-1
  distance 0x1.2162b3cbabc12p+5
  size 0x1.4p+5
distance_to_frustum: where the printed region tests err
  frustum 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p+0 0x1p-1 0x1p+0 0x1p+2
  point 0x1.4p+2 0x1.ep+5 0x1.8p+1
  distance 0x1.d0234e1ae90d3p+5
  size 0x1.ep+5
distance_to_frustum: where the printed region tests err
  frustum 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p+0 0x1p-1 0x1p+0 0x1p+2
  point 0x1.4p+5 -0x1.4p+1 -0x1.ep+4
  distance 0x1.8c295d842c71fp+5
  size 0x1.4p+5
distance_to_frustum: on the border of regions
  frustum 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p+0 0x1p-1 0x1p+0 0x1p+2
  point 0x1p+2 0x1p+1 0x1.8p+2
  distance 0x1p+1
  size 0x1.8p+2
distance_to_frustum: on the border of regions
  frustum 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p+0 0x1p-1 0x1p+0 0x1p+2
  point 0 0 0
  distance 0x1p+0
  size 0x1p+0
distance_to_frustum: extreme sizes
  frustum 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1.0c6f7a0b5ed8dp-20 0x1.0c6f7a0b5ed8dp-20
    0x1.0c6f7a0b5ed8dp-20 0x1.e848p+19
  point 0x1.92a737110e454p-20 0x1.92a737110e454p-20 0x1.4f8b588e368fp-20
  distance 0x1.b65a6f833b14dp-23
  size 0x1.92a737110e454p-20
distance_to_frustum: extreme sizes
  frustum 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1.f4p+9 0x1.0624dd2f1a9fcp-10 0x1.0624dd2f1a9fcp-10
    0x1.dcd65p+29
  point 0x1.f4p+7 0x1.0624dd2f1a9fcp-9 0x1.0624dd2f1a9fcp-11
  distance 0x1.160bb2fff6951p-10
  size 0x1.f4p+7
distance_to_frustum: extreme sizes
  frustum 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1.3529ba7d19eafp-565 0x1.3529ba7d19eafp-565
    0x1.3529ba7d19eafp-565 0x1.e3113363787f2p-559
  point 0x1.cfbe97bba6e06p-564 0 0x1.e7e5da4d6ce6dp-560
  distance 0
  size 0x1.e7e5da4d6ce6dp-560
distance_to_frustum: extreme sizes
  frustum 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1.6c2d4256ffcc3p+531 0x1.6c2d4256ffcc3p+531
    0x1.6c2d4256ffcc3p+531 0x1.1c835bd3f7d78p+538
  point 0x1.aac509bdf3c34p+538 0x1.63a432c8f5cd6p+538 0x1.000fd2a52bdb9p+538
  distance 0x1.432510b64d54dp+537
  size 0x1.aac509bdf3c34p+538
distance_to_frustum: millimetres, far from the origin
  frustum 0x1.0dcb2024a5b9p+26 -0x1.05fb9137a2f33p+28 -0x1.685378586ec79p+26 -0x1.d41782357bb66p-6
    -0x1.91673d7c894e5p-4 0x1.fd53533d707c6p-1 0x1.df3e52abf8404p-1 -0x1.684c8e332d5fp-2 -0x1.fddacbadc3563p-8
    0x1.67329ab0354e4p-2 0x1.dca0519e071dbp-1 0x1.a0e5c2f857b94p-4 0x1.0624dd2f1a9fcp-10 0x1.6f0068db8bac7p-11
    0x1.0624dd2f1a9fcp-10 0x1.47ae147ae147bp-6
  point 0x1.0dcb202627f12p+26 -0x1.05fb9137479e2p+28 -0x1.6853785a0d5c9p+26
  distance 0x1.51ce19cae2af4p-7
  size 0x1.9e95p-6
distance_to_frustum: an edge where the printed test reads 1 for ell
  frustum 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p+1 0x1.8p+1 0x1.8p+2 0x1.8p+3
  point 0x1p+2 0x1.8p+2 0x1.8p+2
  distance 0x1.8b949a85371acp+1
  size 0x1.8p+3
distance_boxes: corner to corner
  box_a 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p+0 0x1p+0 0x1p+0
  box_b 0x1p+2 0x1.8p+1 0x1.cp+1 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p+0 0x1p+0 0x1p+0
  distance 0x1.58a68a4a8d9f3p+1
  size 0x1.8p+2
distance_boxes: edges cross at a tiny angle, only their cross product decides
  box_a 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p+0 0x1p+0 0x1p+0
  box_b 0x1.00000001d27bcp+1 0x1.00000001d27bcp+1 0 0x1.4c0a98c0c8c21p-59 0x1p+0 -0x1.238d53047ff27p-29 0x1p+0
    0x1.4c0a98c0c8c21p-59 0x1.238d53047ff27p-29 -0x1.238d53047ff27p-29 0x1.238d53047ff27p-29 0x1p+0 0x1p+0
    0x1p+0 0x1p+0
  distance 0x1.49da83ca80984p-30
  size 0x1.0000000330588p+2
distance_boxes: faces all but parallel
  box_a 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p+0 0x1p+0 0x1p+0
  box_b 0x1p-2 -0x1p-2 0x1.000008637bd06p+1 0x1.fffffffffffffp-1 -0x1.8161af67a8723p-28 -0x1.3f11391505a14p-27
    0x1.8161afaa88455p-28 0x1p+0 0x1.ad3f2bd2d522dp-28 0x1.3f113900d422ep-27 -0x1.ad3f2c0edf77bp-28
    0x1.fffffffffffffp-1 0x1p+1 0x1.8p+0 0x1p+0
  distance 0x1.094ef0d563336p-20
  size 0x1.0000044fbe76cp+2
distance_boxes: extents of ratio 1e12
  box_a 0 0 0 -0x1.a852b9d01569dp-2 -0x1.1edd716913dabp-1 -0x1.6f34a05220ef6p-1 -0x1.cca1f39cec546p-2
    0x1.9f4d894fa7366p-1 -0x1.7ebcb104ecea7p-2 0x1.95133be510c6ap-1 0x1.5788c3e54975fp-3 -0x1.2d22806eebe67p-1
    0x1.e848p+19 0x1.e848p+19 0x1.0c6f7a0b5ed8dp-20
  box_b 0x1.86b572e88f35dp+20 -0x1.8bf9fb9783955p+19 0x1.07c2d1cc52df7p+21 0x1.c9b58d006acd1p-4
    -0x1.d6e4cfd8387a4p-1 0x1.816189f4138a2p-2 -0x1.3faf2621addf5p-1 -0x1.703d8c62c816ep-2 -0x1.63077d96fc7c5p-1
    0x1.8bd1a57b55837p-1 -0x1.428f2c391dcd8p-3 -0x1.3a97bdf5cf757p-1 0x1.e848p+19 0x1.e848p+19
    0x1.0c6f7a0b5ed8dp-20
  distance 0x1.4f8cb3cfe8ae5p-17
  size 0x1.07c2d1cc5051fp+22
distance_boxes: millimetres, far from the origin
  box_a -0x1.c24d55fe5c543p+19 0x1.604aed1d31e28p+18 0x1.79fca541e82fdp+19 0x1.28414b3ba5b24p-2
    -0x1.0cb491a435c97p-2 -0x1.d75460df0bf39p-1 -0x1.b261203bf2ea3p-1 -0x1.0804f4b746c74p-1 -0x1.ea0c9b0d6dccp-4
    -0x1.c5f23625bad12p-2 0x1.a198cbc9d76fdp-1 -0x1.7cbc917b0aa57p-2 0x1.0624dd2f1a9fcp-10 0x1.0624dd2f1a9fcp-9
    0x1.0624dd2f1a9fcp-10
  box_b -0x1.c24d55ecda54dp+19 0x1.604aed3140e87p+18 0x1.79fca51421d57p+19 -0x1.256f7dccc3f26p-1
    -0x1.671794f0b79c4p-1 0x1.b204125b80c61p-2 0x1.80aaae57b22eep-1 -0x1.4ffe1d670e1f8p-1 -0x1.1eb70aaa56ddfp-4
    0x1.4f16b61b590c2p-2 0x1.1cff31398895fp-2 0x1.ce597ac8462a3p-1 0x1.0624dd2f1a9fcp-9 0x1.0624dd2f1a9fcp-10
    0x1.0624dd2f1a9fcp-8
  distance 0x1.4f8b72993ac79p-17
  size 0x1.7db88f5621db6p-7
distance_boxes: squares underflow
  box_a 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p-540 0x1p-540 0x1p-540
  box_b 0x1.8p-539 0x1p-541 0x1p-542 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p-540 0x1p-540 0x1p-540
  distance 0x1p-540
  size 0x1.4p-538
distance_boxes: squares overflow
  box_a 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p+600 0x1p+600 0x1p+600
  box_b 0x1.8p+601 0x1.8p+601 0x1p+602 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p+600 0x1p+600 0x1p+600
  distance 0x1.3988e1409212ep+601
  size 0x1.8p+602
distance_boxes: a flat box
  box_a 0x1p-2 0x1p-1 0x1.8p+1 -0x1.5381085dcd9d5p-1 -0x1.61fa4e2e0c3e6p-1 -0x1.25cecdab271dfp-2
    0x1.dd6c7b9d7f73cp-4 0x1.2210dca0f125fp-2 -0x1.e7639232af217p-1 0x1.7a93603a3ad64p-1 -0x1.544eb88c6cabdp-1
    -0x1.b74a5e2d4f96p-4 0 0 0
  box_b 0 0 0 0x1p+0 0 0 0 0x1p+0 0 0 0 0x1p+0 0x1p+0 0x1p+0 0x1p+0
  distance 0x1p+1
  size 0x1p+2
distance_polygons: identical polygons
  polygon_a 0 0 0x1p+0 0 0x1p+0 0x1p+0 0 0x1p+0
  polygon_b 0 0 0x1p+0 0 0x1p+0 0x1p+0 0 0x1p+0
  distance 0
  size 0x1p+0
distance_polygons: facing edges all but parallel
  polygon_a 0 0 0x1p+0 0 0x1p+0 0x1p+0 0 0x1p+0
  polygon_b -0x1p+0 0x1.800000044b803p+0 0x1p+1 0x1.800000044b88ap+0 0x1.fffffffffffd3p+0 0x1.4000000225c45p+1
    -0x1.000000000002dp+0 0x1.4000000225c02p+1
  distance 0x1.000000089706p-1
  size 0x1.8000000000016p+1
distance_polygons: millimetres, far from the origin
  polygon_a 0x1.98dd71a27f97dp+25 -0x1.d1a0519041acap+29 0x1.98dd71a260c0ap+25 -0x1.d1a05190403b5p+29
    0x1.98dd71a241455p+25 -0x1.d1a05190419e8p+29 0x1.98dd71a24ca79p+25 -0x1.d1a0519043eb5p+29
    0x1.98dd71a2732cp+25 -0x1.d1a0519043f41p+29
  polygon_b 0x1.98dd71a2c5b4ap+25 -0x1.d1a0519042134p+29 0x1.98dd71a2b6df4p+25 -0x1.d1a05190408f1p+29
    0x1.98dd71a29aa83p+25 -0x1.d1a051904056ap+29 0x1.98dd71a2864e8p+25 -0x1.d1a0519041946p+29
    0x1.98dd71a289253p+25 -0x1.d1a0519043591p+29 0x1.98dd71a2a1092p+25 -0x1.d1a05190444fdp+29
    0x1.98dd71a2bbfcdp+25 -0x1.d1a0519043bedp+29
  distance 0x1.b5357918226e8p-13
  size 0x1.08deap-8
distance_polygons: squares underflow
  polygon_a 0 0 0x1p-540 0 0x1p-540 0x1p-540 0 0x1p-540
  polygon_b 0x1p-539 0x1.8p-539 0x1.8p-539 0x1.8p-539 0x1.8p-539 0x1p-538 0x1p-539 0x1p-538
  distance 0x1.1e3779b97f4a8p-539
  size 0x1p-538
distance_polygons: squares overflow
  polygon_a 0 0 0x1p+1018 0 0x1p+1018 0x1p+1018 0 0x1p+1018
  polygon_b 0x1.8p+1018 0x1p+1016 0x1.4p+1019 0x1p+1016 0x1.4p+1019 0x1.4p+1018 0x1.8p+1018 0x1.4p+1018
  distance 0x1p+1017
  size 0x1.4p+1019
distance_polygons: points and segments
  polygon_a 0x1p+1 0x1p-1
  polygon_b 0 0 0x1p+0 0 0x1p+0 0x1p+0 0 0x1p+0
  distance 0x1p+0
  size 0x1p+1
first_contact: a square that passes the corner of another
  polygon_a 0 0 0x1p+0 0 0x1p+0 0x1p+0 0 0x1p+0
  velocity_a 0 0
  polygon_b 0 0x1.4p+1 0x1p+0 0x1.4p+1 0x1p+0 0x1.cp+1 0 0x1.cp+1
  velocity_b 0x1p+0 -0x1p+0
  t_max 0x1.4p+3
  never
  size 0x1.cp+1
first_contact: which features touch
  polygon_a 0 0 0x1p+0 0 0x1p+0 0x1p+0 0 0x1p+0
  velocity_a 0 0
  polygon_b 0x1p+1 0x1p-2 0x1.8p+1 0x1p-2 0x1.8p+1 0x1.4p+0 0x1p+1 0x1.4p+0
  velocity_b -0x1p+0 0
  t_max 0x1.4p+3
  time 0x1p+0
  contact 0x1p+0 0x1p-2 0x1p+0 0x1p+0
  size 0x1.8p+1
first_contact: which features touch
  polygon_a 0 0 0x1p+0 0 0x1p+0 0x1p+0 0 0x1p+0
  velocity_a 0 0
  polygon_b 0x1.8p+1 0 0x1p+2 0x1p+0 0x1.8p+1 0x1p+1 0x1p+1 0x1p+0
  velocity_b -0x1p+0 0
  t_max 0x1.4p+3
  time 0x1p+0
  contact 0x1p+0 0x1p+0
  size 0x1p+2
first_contact: overlapping at the start
  polygon_a 0 0 0x1p+0 0 0x1p+0 0x1p+0 0 0x1p+0
  velocity_a 0 0
  polygon_b 0x1p-1 0x1p-2 0x1.8p+0 0x1p-2 0x1.8p+0 0x1.4p+0 0x1p-1 0x1.4p+0
  velocity_b 0x1p+0 0
  t_max 0x1.4p+3
  time 0
  contact 0x1p-1 0x1p-2 0x1p-1 0x1p+0 0x1p+0 0x1p-2 0x1p+0 0x1p+0
  size 0x1.8p+0
first_contact: moving along together
  polygon_a 0 0 0x1p+0 0 0x1p+0 0x1p+0 0 0x1p+0
  velocity_a 0x1.2a05f2p+33 -0x1.8p+1
  polygon_b 0x1p-1 0x1p-1 0x1.8p+0 0x1p-1 0x1.8p+0 0x1.8p+0 0x1p-1 0x1.8p+0
  velocity_b 0x1.2a05f2p+33 -0x1.8p+1
  t_max 0x1.e848p+19
  time 0
  size 0x1.8p+0
first_contact: repeated and collinear vertices
  polygon_a 0 0 0 0 0x1p+0 0 0x1p+0 0x1p-1 0x1p+0 0x1p-1 0x1p+0 0x1p+0 0x1p-1 0x1p+0 0 0x1p+0 0 0x1p-1
  velocity_a 0 0
  polygon_b 0x1p+1 0x1p-2 0x1p+1 0x1p-2 0x1.8p+1 0x1p-2 0x1.8p+1 0x1.8p-1 0x1.8p+1 0x1.8p-1 0x1.8p+1 0x1.4p+0
    0x1.4p+1 0x1.4p+0 0x1p+1 0x1.4p+0 0x1p+1 0x1.8p-1
  velocity_b -0x1p+0 0
  t_max 0x1.4p+3
  time 0x1p+0
  contact 0x1p+0 0x1p-2 0x1p+0 0x1p+0
  size 0x1.8p+1
first_contact: facing edges all but parallel
  polygon_a 0 0 0x1p+0 0 0x1p+0 0x1p+0 0 0x1p+0
  velocity_a 0 0
  polygon_b -0x1p+0 0x1.7fffffffc9064p+1 0x1p+1 0x1.800000006df38p+1 0x1.ffffffff920c8p+0 0x1.0000000036f9cp+2
    -0x1.000000006df38p+0 0x1.ffffffffc9064p+1
  velocity_b 0 -0x1p+0
  t_max 0x1.4p+3
  time 0x1p+1
  size 0x1.0000000036f9cp+2
first_contact: the velocity all but grazes the edge it reaches
  polygon_a 0 0 0x1p+0 0 0x1p+0 0x1p+0 0 0x1p+0
  velocity_a 0 0
  polygon_b 0x1.8p+1 0x1.0000218def417p+0 0x1p+2 0x1.0000218def417p+0 0x1p+2 0x1.000010c6f7a0cp+1 0x1.8p+1
    0x1.000010c6f7a0cp+1
  velocity_b -0x1p+0 -0x1.0c6f7a0b5ed8dp-20
  t_max 0x1.f4p+9
  time 0x1.000000001f9ep+1
  size 0x1p+2
first_contact: millimetres, far from the origin
  polygon_a -0x1.f31a92f1b7f59p+24 -0x1.9f577c286306cp+24 -0x1.f31a92f1f5a3ep+24 -0x1.9f577c2834dd3p+24
    -0x1.f31a92f2349a8p+24 -0x1.9f577c286142ep+24 -0x1.f31a92f21dd6p+24 -0x1.9f577c28aadcdp+24
    -0x1.f31a92f1d0cd3p+24 -0x1.9f577c28abf41p+24
  velocity_a 0 0x1.0624dd2f1a9fcp-10
  polygon_b -0x1.f31a92efa9125p+24 -0x1.9f577c28694c2p+24 -0x1.f31a92efc6bd1p+24 -0x1.9f577c2838c75p+24
    -0x1.f31a92efff2b4p+24 -0x1.9f577c2831b8ep+24 -0x1.f31a92f027debp+24 -0x1.9f577c2859711p+24
    -0x1.f31a92f022314p+24 -0x1.9f577c2892071p+24 -0x1.f31a92eff2697p+24 -0x1.9f577c28b0deap+24
    -0x1.f31a92efbc821p+24 -0x1.9f577c289ebe2p+24
  velocity_b -0x1.0624dd2f1a9fcp-10 0x1.0624dd2f1a9fcp-10
  t_max 0x1.9p+6
  time 0x1.87a6c1c91765ep+2
  size 0x1.45c418p-7
first_contact: squares underflow
  polygon_a 0 0 0x1p-540 0 0x1p-540 0x1p-540 0 0x1p-540
  velocity_a 0 0
  polygon_b 0x1p-539 0x1p-539 0x1.8p-539 0x1p-539 0x1.8p-539 0x1.8p-539 0x1p-539 0x1.8p-539
  velocity_b -0x1p-540 -0x1p-541
  t_max 0x1.4p+3
  time 0x1p+1
  size 0x1.8p-539
first_contact: needles at right angles
  polygon_a 0 0 0x1.e848p+19 0 0x1.e848p+19 0x1.0c6f7a0b5ed8dp-20 0 0x1.0c6f7a0b5ed8dp-20
  velocity_a 0 0
  polygon_b 0x1.e848p+18 -0x1.86ap+16 0x1.e84800000431cp+18 -0x1.86ap+16 0x1.e84800000431cp+18 0x1.b774p+19
    0x1.e848p+18 0x1.b774p+19
  velocity_b 0x1p-2 -0x1p+0
  t_max 0x1.f4p+9
  time 0
  size 0x1.e848p+19
first_contact: points and segments
  polygon_a 0 0 0x1p+1 0x1p+1
  velocity_a 0 0
  polygon_b 0x1.4p+2 0x1p+0 0x1.8p+2 0
  velocity_b -0x1p+0 0
  t_max 0x1.4p+3
  time 0x1p+2
  contact 0x1p+0 0x1p+0
  size 0x1.8p+2
first_contact: edges meet in a segment that the printed code shrinks to a point
  polygon_a 0x1.8p+1 0 0 0x1p+1 0x1p+1 0
  velocity_a 0x1p+1 0x1p+0
  polygon_b -0x1p+1 -0x1p+1 0x1p+1 -0x1p+0 0x1p+0 -0x1p+0
  velocity_b 0x1.8p+1 0x1p+1
  t_max 0x1.4p+3
  time 0x1p+0
  contact 0x1p+2 0x1p+0 0x1.4p+2 0x1p+0
  size 0x1p+3
"""
