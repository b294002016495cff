(* Homes: where each robot on a closed path has a place to itself, everyone can go on for ever iff all can come home.

   Robots drive from place to place, those on closed paths for ever, the others to their ends. A place holds some robots
   and is left in order of arrival, or in any order. A home is a spot on a closed path in a place that no other robot
   visits; nobody ends in a place that this path visits. *)
Require Import List Arith Lia.
Import ListNotations.

Lemma in_map_split {A} (f : A -> nat) l a b : NoDup (map f l) -> In a l -> In b l -> f a = f b -> a = b.
Proof.
  induction l as [|c l IH]; simpl; intros N I J E; [contradiction|]. inversion N as [|x y Nx Nl]; subst.
  destruct I as [<-|I], J as [<-|J]; auto; exfalso; apply Nx; [rewrite E|rewrite <- E]; apply in_map; auto.
Qed.

Lemma filter_all {A} (f : A -> bool) l : (forall a, In a l -> f a = true) -> filter f l = l.
Proof. induction l as [|a l IH]; simpl; intro H; auto. rewrite (H a) by auto. rewrite IH; auto. Qed.

Lemma filter_shorter {A} (f : A -> bool) l : length (filter f l) <= length l.
Proof. induction l as [|a l IH]; simpl; auto. destruct (f a); simpl; lia. Qed.

Section Homes.
(* where a robot stands on its path: in which place, whose path it is, what comes after, and whether it is a home *)
Variable spot : Type.
Variable place : spot -> nat.
Variable who : spot -> nat.
Variable next : spot -> option spot.
Variable home : spot -> bool.
Variable slots : nat -> nat.
Variable in_line : nat -> bool.  (* left in order of arrival *)
Variable robots : nat.

Hypothesis some_slot : forall p, 0 < slots p.
Hypothesis who_is : forall s, who s < robots.
Hypothesis same_path : forall s t, next s = Some t -> who t = who s.
Hypothesis no_self : forall s t, next s = Some t -> place t <> place s.

(* the spot some moves on; who is at the end stays *)
Definition onward s := match next s with Some t => t | None => s end.
Fixpoint far (k : nat) (s : spot) : spot := match k with 0 => s | S j => far j (onward s) end.

Hypothesis home_is_own : forall h s, home h = true -> place s = place h -> who s = who h.
Hypothesis home_comes_again : forall h, home h = true -> exists k, far (S k) h = h.
Hypothesis ends_apart : forall h s t, home h = true -> who s = who h -> next t = None -> place t <> place s.
Hypothesis has_home_or_end : forall s, exists k, home (far (S k) s) = true \/ next (far (S k) s) = None.

(* who stands in each place, first in line first: each robot once *)
Definition config := nat -> list spot.
Definition possible (D : config) :=
  (forall p, length (D p) <= slots p) /\ (forall p s, In s (D p) -> place s = p) /\
  (forall p, NoDup (map who (D p))) /\ (forall p q s t, In s (D p) -> In t (D q) -> who s = who t -> p = q) /\
  forall r, r < robots -> exists p s, In s (D p) /\ who s = r.

Definition move s (D E : config) := exists t a b,
  next s = Some t /\ D (place s) = a ++ s :: b /\ (in_line (place s) = true -> a = []) /\
  length (D (place t)) < slots (place t) /\
  E (place s) = a ++ b /\ E (place t) = D (place t) ++ [t] /\
  forall p, p <> place s -> p <> place t -> E p = D p.

(* moves one after another, and from which spots *)
Inductive run : config -> list spot -> config -> Prop :=
| nothing D : run D [] D
| more s D E l F : move s D E -> run E l F -> run D (s :: l) F.

(* a set of configurations from each of which each robot that is not at its end can move on, and back into the set *)
Definition keeps (L : config -> Prop) := forall D p s t, L D -> In s (D p) -> next s = Some t ->
  exists l E, run D l E /\ L E /\ exists u, In u l /\ who u = who s.
Definition live (D : config) := exists L, keeps L /\ L D.

Definition all_home (D : config) := forall p s, In s (D p) -> home s = true \/ next s = None.
Definition can_come_home (D : config) := exists l H, run D l H /\ all_home H.

Lemma run_app D l E m F : run D l E -> run E m F -> run D (l ++ m) F.
Proof. induction 1; simpl; auto. intro. eapply more; eauto. Qed.

Lemma one_spot D p q s t : possible D -> In s (D p) -> In t (D q) -> who s = who t -> s = t.
Proof.
  intros (_ & _ & N & One & _) I J E. assert (p = q) by (eapply One; eauto). subst q.
  apply (in_map_split who (D p)); auto.
Qed.

(* who stands where after a move: the one who moved, and all others as before *)
Lemma after s t (D E : config) : possible D -> move s D E -> next s = Some t ->
  forall p x, In x (E p) <-> (x = t /\ p = place t) \/ (In x (D p) /\ who x <> who s).
Proof.
  intros P (t' & a & b & Nt & Ds & _ & _ & Es & Et & Rest) Nt' p x. rewrite Nt' in Nt. injection Nt as <-.
  assert (NS := no_self _ _ Nt'). assert (Ss : In s (D (place s))) by (rewrite Ds; apply in_or_app; right; left; auto).
  destruct P as (_ & Pl & N & One & _).
  destruct (Nat.eq_dec p (place s)) as [->|Ns]; [|destruct (Nat.eq_dec p (place t)) as [->|Np]].
  - rewrite Es. specialize (N (place s)). rewrite Ds, map_app in N. simpl in N. apply NoDup_remove_2 in N.
    rewrite <- map_app in N. rewrite Ds. split.
    + intro I. right. split; [apply in_app_or in I; apply in_or_app; simpl; tauto|]. intro W. apply N. rewrite <- W.
      apply in_map. auto.
    + intros [[_ F]|[I W]]; [exfalso; auto|]. apply in_app_or in I. apply in_or_app.
      destruct I as [I|[<-|I]]; auto. contradiction.
  - rewrite Et. split.
    + intro I. apply in_app_or in I. destruct I as [I|[<-|[]]]; auto. right. split; auto. intro W. apply NS. eauto.
    + intros [[-> _]|[I _]]; apply in_or_app; simpl; auto.
  - rewrite Rest by auto. split.
    + intro I. right. split; auto. intro W. apply Ns. eauto.
    + intros [[_ F]|[I _]]; [contradiction|auto].
Qed.

Lemma move_possible s D E : possible D -> move s D E -> possible E.
Proof.
  intros P M. assert (M' := M). destruct M' as (t & a & b & Nt & Ds & _ & Room & Es & Et & Rest).
  assert (A := after s t D E P M Nt). assert (Wt := same_path _ _ Nt). assert (NS := no_self _ _ Nt).
  assert (Ss : In s (D (place s))) by (rewrite Ds; apply in_or_app; right; left; auto).
  assert (P' := P). destruct P' as (Len & Pl & N & One & All). repeat split.
  - intro p. destruct (Nat.eq_dec p (place s)) as [->|Ns].
    { specialize (Len (place s)). rewrite Ds in Len. rewrite Es. rewrite app_length in *. simpl in *. lia. }
    destruct (Nat.eq_dec p (place t)) as [->|Np]; [rewrite Et, app_length; simpl; lia|rewrite Rest; auto].
  - intros p x I. apply A in I. destruct I as [[-> ->]|[I _]]; auto.
  - intro p. destruct (Nat.eq_dec p (place s)) as [->|Ns].
    { rewrite Es, map_app. specialize (N (place s)). rewrite Ds, map_app in N. apply NoDup_remove_1 in N. auto. }
    destruct (Nat.eq_dec p (place t)) as [->|Np]; [|rewrite Rest; auto].
    rewrite Et, map_app. simpl. apply (NoDup_Add (Add_app (who t) (map who (D (place t))) [])). rewrite app_nil_r.
    split; auto. intro I. apply in_map_iff in I. destruct I as (u & W & I). apply NS.
    apply (One (place t) (place s) u s); auto. congruence.
  - intros p q x y I J W. apply A in I. apply A in J.
    destruct I as [[-> ->]|[I Wx]], J as [[-> ->]|[J Wy]]; auto; try congruence. eauto.
  - intros r L. destruct (All r L) as (p & x & I & W). destruct (Nat.eq_dec r (who s)) as [->|Nr].
    + exists (place t), t. split; [apply A; auto|auto].
    + exists p, x. split; auto. apply A. right. split; auto. congruence.
Qed.

Lemma run_possible D l E : run D l E -> possible D -> possible E.
Proof. induction 1; auto. intro P. apply IHrun. eapply move_possible; eauto. Qed.

Lemma far_onward k s : far (S k) s = onward (far k s).
Proof. revert s. induction k as [|k IH]; intro s; auto. simpl in *. rewrite <- IH. auto. Qed.

Lemma far_far j k s : far j (far k s) = far (k + j) s.
Proof. revert s. induction k as [|k IH]; intro s; simpl; auto. Qed.

Lemma who_far k s : who (far k s) = who s.
Proof.
  revert s. induction k as [|k IH]; intro s; simpl; auto. rewrite IH. unfold onward.
  destruct (next s) eqn:E; auto.
Qed.

(* a robot moves along its path, spot by spot *)
Lemma along D l E : run D l E -> possible D -> forall p s, In s (D p) -> exists m, In (far m s) (E (place (far m s))) /\
  (forall j, j < m -> In (far j s) l /\ next (far j s) = Some (far (S j) s)) /\ forall u, In u l -> who u = who s -> 0 < m.
Proof.
  induction 1 as [D|v D E l F M R IH]; intros P p s I.
  - exists 0. simpl. split; [|split; [intros; lia|intros u []]]. destruct P as (_ & Pl & _). rewrite (Pl p s I). auto.
  - assert (PE := move_possible v D E P M). assert (M' := M). destruct M' as (t & a & b & Nt & Dv & _).
    assert (A := after v t D E P M Nt).
    assert (Iv : In v (D (place v))) by (rewrite Dv; apply in_or_app; right; left; auto).
    destruct (Nat.eq_dec (who s) (who v)) as [W|W].
    + assert (s = v) by (apply (one_spot D p (place v)); auto). subst v. assert (O : onward s = t) by (unfold onward; rewrite Nt; auto).
      destruct (IH PE (place t) t) as (m & Im & Before & _); [apply A; auto|]. exists (S m). simpl. rewrite O. split; auto.
      split; [|intros; lia]. intros [|j] L; simpl; [auto|]. rewrite O. destruct (Before j) as [B1 B2]; [lia|]. auto.
    + destruct (IH PE p s) as (m & Im & Before & Moved); [apply A; right; auto|]. exists m. split; auto. split.
      * intros j L. destruct (Before j L). simpl. auto.
      * intros u [<-|Iu] Wu; [congruence|]. apply (Moved u); auto.
Qed.

Lemma end_stays D l E p e : run D l E -> possible D -> In e (D p) -> next e = None -> In e (E (place e)).
Proof.
  intros R P I N. destruct (along D l E R P p e I) as ([|m] & Im & Before & _); auto.
  destruct (Before 0) as [_ F]; [lia|]. simpl in F. congruence.
Qed.

(* All at home: each robot on a closed path can go round alone. *)
Section Round.
Variable H : config.
Variable h : spot.
Hypothesis possible_h : possible H.
Hypothesis at_home : all_home H.
Hypothesis stands : In h (H (place h)).
Hypothesis is_home : home h = true.

Lemma goes_on s : who s = who h -> exists t, next s = Some t.
Proof. intro W. destruct (next s) as [t|] eqn:E; eauto. exfalso. apply (ends_apart h s s); auto. Qed.

Lemma empty_on_the_way s : who s = who h -> place s <> place h -> H (place s) = [].
Proof.
  intros W N. destruct (H (place s)) as [|x l] eqn:E; auto. exfalso.
  assert (I : In x (H (place s))) by (rewrite E; left; auto). assert (Px : place x = place s) by (apply possible_h; auto).
  destruct (at_home _ _ I) as [Hx|Nx]; [|apply (ends_apart h s x); auto].
  assert (Wx : who s = who x) by (apply home_is_own; auto).
  assert (x = h) by (eapply one_spot; eauto; congruence). subst x. auto.
Qed.

Lemma alone_at_home : H (place h) = [h].
Proof.
  destruct possible_h as (_ & Pl & N & _). specialize (N (place h)).
  assert (A : forall x, In x (H (place h)) -> x = h).
  { intros x I. apply (one_spot H (place h) (place h)); auto. }
  destruct (H (place h)) as [|x [|y l]]; [destruct stands| |].
  - f_equal. apply A. left. auto.
  - exfalso. rewrite (A x), (A y) in N by (simpl; auto). simpl in N. inversion N as [|z w Nz _]. apply Nz. left. auto.
Qed.

(* the robot at s, all others as they are *)
Definition it_at s : config := fun p => if Nat.eq_dec p (place s) then [s] else if Nat.eq_dec p (place h) then [] else H p.

Lemma one_on s t D : who s = who h -> next s = Some t -> (forall p, D p = it_at s p) -> move s D (it_at t).
Proof.
  intros W Nt Same. assert (NS := no_self _ _ Nt). assert (Wt : who t = who h) by (rewrite <- W; auto).
  assert (Empty : D (place t) = []).
  { rewrite Same. unfold it_at. destruct (Nat.eq_dec (place t) (place s)); [contradiction|].
    destruct (Nat.eq_dec (place t) (place h)); auto. apply empty_on_the_way; auto. }
  exists t, [], []. split; auto. split; [rewrite Same; unfold it_at; destruct (Nat.eq_dec (place s) (place s)); auto; contradiction|].
  split; auto. split; [rewrite Empty; simpl; auto|]. rewrite Empty. unfold it_at. split; [|split].
  - destruct (Nat.eq_dec (place s) (place t)); [congruence|]. destruct (Nat.eq_dec (place s) (place h)); auto.
    apply empty_on_the_way; auto.
  - destruct (Nat.eq_dec (place t) (place t)); auto; contradiction.
  - intros p Ns Nt2. rewrite Same. unfold it_at. destruct (Nat.eq_dec p (place t)); [contradiction|].
    destruct (Nat.eq_dec p (place s)); [contradiction|]. auto.
Qed.

Lemma some_on k : forall s D, who s = who h -> (forall p, D p = it_at s p) ->
  exists l E, run D l E /\ (forall p, E p = it_at (far k s) p) /\ (0 < k -> In s l).
Proof.
  induction k as [|k IH]; intros s D W Same; [exists [], D; split; [constructor|split; auto; lia]|].
  destruct (goes_on s W) as [t Nt]. destruct (IH t (it_at t)) as (l & E & R & SameE & _); auto; [rewrite <- W; auto|].
  exists (s :: l), E. split; [eapply more; eauto; apply one_on; auto|]. simpl. unfold onward. rewrite Nt. auto.
Qed.

Lemma goes_round : exists l E, run H l E /\ all_home E /\ In h l.
Proof.
  assert (Same : forall p, H p = it_at h p).
  { intro p. unfold it_at. destruct (Nat.eq_dec p (place h)); auto. subst p. apply alone_at_home. }
  destruct (home_comes_again h is_home) as [k K]. destruct (some_on (S k) h H eq_refl Same) as (l & E & R & SameE & I).
  exists l, E. split; auto. split; [|apply I; lia]. intros p s J. apply (at_home p). rewrite Same, <- K at 1. rewrite <- SameE. auto.
Qed.
End Round.

Theorem home_then_live D : possible D -> can_come_home D -> live D.
Proof.
  intros P C. exists (fun E => possible E /\ can_come_home E). split; auto. clear D P C.
  intros D p s t (P & l & H & R & A) I Nt. assert (PH := run_possible _ _ _ R P).
  destruct (along D l H R P p s I) as (m & Im & Before & _).
  destruct (A _ _ Im) as [Hm|Nm].
  - destruct (goes_round H (far m s) PH A Im Hm) as (l2 & E & R2 & AE & I2).
    exists (l ++ l2), E. split; [eapply run_app; eauto|]. split.
    + split; [eapply run_possible; eauto|]. exists [], E. split; [constructor|auto].
    + exists (far m s). split; [apply in_or_app; auto|apply who_far].
  - exists l, H. split; auto. split; [split; auto; exists [], H; split; [constructor|auto]|].
    destruct m as [|m]; [simpl in Nm; congruence|]. exists s. split; auto. apply (Before 0). lia.
Qed.

(* Everyone goes on: then all can be at home at once, if each stays when it comes home. *)
Definition came_home l r := exists u h, In u l /\ next u = Some h /\ home h = true /\ who u = r.

Lemma comes_home (L : config -> Prop) : keeps L -> forall k D p s, L D -> possible D -> In s (D p) ->
  home (far (S k) s) = true \/ next (far (S k) s) = None ->
  exists l E, run D l E /\ L E /\ (came_home l (who s) \/ exists e, In e (E (place e)) /\ who e = who s /\ next e = None).
Proof.
  intro K. induction k as [k IH] using lt_wf_ind. intros D p s LD P I Goal.
  destruct (next s) as [t|] eqn:Nt.
  2:{ exists [], D. split; [constructor|]. split; auto. right. exists s. split; auto. destruct P as (_ & Pl & _).
      rewrite (Pl p s I). auto. }
  destruct (K D p s t LD I Nt) as (l & E & R & LE & u & Iu & Wu).
  destruct (along D l E R P p s I) as (m & Im & Before & Moved). assert (Some_ := Moved u Iu Wu).
  destruct (le_lt_dec m k) as [Le|Lt].
  - destruct (IH (k - m) ltac:(lia) E (place (far m s)) (far m s) LE (run_possible _ _ _ R P) Im) as (l2 & F & R2 & LF & Out).
    { rewrite far_far. replace (m + S (k - m)) with (S k) by lia. auto. }
    rewrite who_far in Out. exists (l ++ l2), F. split; [eapply run_app; eauto|]. split; auto.
    destruct Out as [(v & h & Iv & V)|Out]; auto. left. exists v, h. split; auto. apply in_or_app. auto.
  - destruct (Before k Lt) as [Ik Nk]. exists l, E. split; auto. split; auto. destruct Goal as [Hk|Ek].
    + left. exists (far k s), (far (S k) s). split; auto. split; auto. split; auto. apply who_far.
    + right. destruct (Nat.eq_dec m (S k)) as [->|Nm]; [exists (far (S k) s); split; auto; split; auto; apply who_far|].
      destruct (Before (S k)) as [_ F]; [lia|]. congruence.
Qed.

Lemma everyone_comes_home (L : config -> Prop) D n : keeps L -> L D -> possible D -> n <= robots ->
  exists l E, run D l E /\ L E /\ forall p s, In s (E p) -> who s < n -> came_home l (who s) \/ next s = None.
Proof.
  intros K LD P. induction n as [|n IH]; intro Le; [exists [], D; split; [constructor|split; auto; intros; lia]|].
  destruct IH as (l & E & R & LE & Past); [lia|]. assert (PE := run_possible _ _ _ R P).
  assert (PE' := PE). destruct PE' as (_ & _ & _ & _ & All). destruct (All n) as (q & x & Ix & Wx); [lia|].
  destruct (has_home_or_end x) as [k G]. destruct (comes_home L K k E q x LE PE Ix G) as (l2 & F & R2 & LF & Out).
  assert (PF := run_possible _ _ _ R2 PE). exists (l ++ l2), F. split; [eapply run_app; eauto|]. split; auto.
  intros p s I W. destruct (Nat.eq_dec (who s) n) as [En|Nn].
  - destruct Out as [(v & h & Iv & Nv & Hv & Wv)|(e & Ie & We & Ne)].
    + left. exists v, h. split; [apply in_or_app; auto|]. split; auto. split; auto. congruence.
    + right. assert (s = e); [|congruence]. eapply one_spot; eauto. congruence.
  - destruct (All (who s) (who_is s)) as (q0 & y & Iy & Wy).
    destruct (Past q0 y Iy ltac:(lia)) as [(v & h & Iv & Nv & Hv & Wv)|Ny].
    + left. exists v, h. split; [apply in_or_app; auto|]. split; auto. split; auto. congruence.
    + right. assert (s = y); [|congruence]. apply (one_spot F p (place y)); auto. eapply end_stays; eauto.
Qed.

(* the same run, in which some stay at home: who has stayed, and where *)
Definition staying := nat -> option spot.
Definition free (stay : staying) s := match stay (who s) with None => true | Some _ => false end.
Definition same_but (stay : staying) (D G : config) := (forall r h, stay r = Some h -> who h = r /\ home h = true) /\
  forall p, (exists r h, stay r = Some h /\ place h = p /\ G p = [h]) \/
    ((forall r h, stay r = Some h -> place h <> p) /\ G p = filter (free stay) (D p)).

Lemma not_theirs stay D G s : same_but stay D G -> stay (who s) = None -> G (place s) = filter (free stay) (D (place s)).
Proof.
  intros [Are Here] N. destruct (Here (place s)) as [(r & h & Sr & Ph & _)|[_ E]]; auto. exfalso.
  destruct (Are r h Sr) as [Wh Hh]. assert (who s = who h) by (apply home_is_own; auto). congruence.
Qed.

Lemma a_move_less stay D G s E : possible D -> same_but stay D G -> move s D E ->
  exists l F stay2, run G l F /\ same_but stay2 E F /\ (forall r, stay r <> None -> stay2 r <> None) /\
    forall h, next s = Some h -> home h = true -> stay2 (who s) <> None.
Proof.
  intros P SB M. assert (PE := move_possible s D E P M). assert (M' := M).
  destruct M' as (t & a & b & Nt & Ds & Fi & Room & Es & Et & Rest). assert (A := after s t D E P M Nt).
  assert (Wt := same_path _ _ Nt). assert (NS := no_self _ _ Nt). assert (SB' := SB). destruct SB' as [Are Here].
  destruct (stay (who s)) as [h|] eqn:Ss.
  { exists [], G, stay. split; [constructor|]. split; [split; auto|split; auto; intros; congruence]. intro p.
    assert (Fs : free stay s = false) by (unfold free; rewrite Ss; auto).
    assert (Ft : free stay t = false) by (unfold free; rewrite Wt, Ss; auto).
    destruct (Here p) as [X|[Np Gp]]; auto. right. split; auto. rewrite Gp.
    destruct (Nat.eq_dec p (place s)) as [->|Ns]; [rewrite Ds, Es, !filter_app; simpl; rewrite Fs; auto|].
    destruct (Nat.eq_dec p (place t)) as [->|Nt2]; [|rewrite Rest; auto].
    rewrite Et, filter_app. simpl. rewrite Ft, app_nil_r. auto. }
  assert (Fs : free stay s = true) by (unfold free; rewrite Ss; auto).
  assert (St : stay (who t) = None) by congruence. assert (Ft : free stay t = true) by (unfold free; rewrite St; auto).
  assert (Gs := not_theirs stay D G s SB Ss). assert (Gt := not_theirs stay D G t SB St).
  set (F := fun p => if Nat.eq_dec p (place s) then filter (free stay) (a ++ b)
                     else if Nat.eq_dec p (place t) then G p ++ [t] else G p).
  assert (MG : move s G F).
  { exists t, (filter (free stay) a), (filter (free stay) b). unfold F. split; auto. repeat split.
    - rewrite Gs, Ds, filter_app. simpl. rewrite Fs. auto.
    - intro I. rewrite (Fi I). auto.
    - rewrite Gt. assert (X := filter_shorter (free stay) (D (place t))). lia.
    - destruct (Nat.eq_dec (place s) (place s)); [apply filter_app|contradiction].
    - destruct (Nat.eq_dec (place t) (place s)); [contradiction|]. destruct (Nat.eq_dec (place t) (place t)); auto. contradiction.
    - intros p N1 N2. destruct (Nat.eq_dec p (place s)); [contradiction|]. destruct (Nat.eq_dec p (place t)); auto. contradiction. }
  assert (SF : same_but stay E F).
  { split; auto. intro p. unfold F. destruct (Nat.eq_dec p (place s)) as [->|Ns].
    { right. rewrite Es. split; auto. destruct (Here (place s)) as [(r & h & Sr & Ph & _)|[Np _]]; auto. exfalso.
      destruct (Are r h Sr) as [Wh Hh]. assert (who s = who h) by (apply home_is_own; auto). congruence. }
    destruct (Nat.eq_dec p (place t)) as [->|Np].
    { right. rewrite Et, filter_app, Gt. simpl. rewrite Ft. split; auto.
      destruct (Here (place t)) as [(r & h & Sr & Ph & _)|[Np _]]; auto. exfalso.
      destruct (Are r h Sr) as [Wh Hh]. assert (who t = who h) by (apply home_is_own; auto). congruence. }
    rewrite Rest by auto. apply Here. }
  assert (RG : run G [s] F) by (eapply more; eauto; constructor).
  destruct (home t) eqn:Ht; [|exists [s], F, stay; split; auto; split; auto; split; auto; intros; congruence].
  exists [s], F, (fun r => if Nat.eq_dec r (who s) then Some t else stay r). split; auto.
  split; [|split; [intros r; destruct (Nat.eq_dec r (who s)); congruence|intros _ _ _; destruct (Nat.eq_dec (who s) (who s)); congruence]].
  destruct SF as [_ HF]. split.
  { intros r h. destruct (Nat.eq_dec r (who s)) as [->|]; auto. intros [= <-]. auto. }
  intro p. destruct (Nat.eq_dec p (place t)) as [->|Np].
  - left. exists (who s), t. split; [destruct (Nat.eq_dec (who s) (who s)); auto; contradiction|]. split; auto.
    unfold F. destruct (Nat.eq_dec (place t) (place s)); [contradiction|]. destruct (Nat.eq_dec (place t) (place t)); [|contradiction].
    assert (Empty : D (place t) = []); [|rewrite Gt, Empty; auto]. destruct (D (place t)) as [|x l] eqn:Dt; auto. exfalso.
    assert (Ix : In x (D (place t))) by (rewrite Dt; left; auto). assert (Is : In s (D (place s))) by (rewrite Ds; apply in_or_app; right; left; auto).
    assert (Px : place x = place t) by (apply P; auto). assert (Wx : who x = who t) by (apply home_is_own; auto).
    apply NS. destruct P as (_ & _ & _ & One & _). apply (One (place t) (place s) x s); auto. congruence.
  - destruct (HF p) as [(r & h & Sr & Ph & Fp)|[None_ Fp]].
    + left. exists r, h. split; auto. destruct (Nat.eq_dec r (who s)); congruence.
    + right. split; [intros r h; destruct (Nat.eq_dec r (who s)); [intros [= <-]; auto|apply None_]|].
      rewrite Fp. apply filter_ext_in. intros x I. unfold free. destruct (Nat.eq_dec (who x) (who s)) as [Wx|]; auto.
      exfalso. apply Np. destruct PE as (_ & _ & _ & One & _). apply (One p (place t) x t); auto; [apply A; auto|congruence].
Qed.

Lemma a_run_less D l E : run D l E -> possible D -> forall stay G, same_but stay D G ->
  exists m F stay2, run G m F /\ same_but stay2 E F /\ (forall r, stay r <> None -> stay2 r <> None) /\
    forall r, came_home l r -> stay2 r <> None.
Proof.
  induction 1 as [D|s D E l F M R IH]; intros P stay G SB.
  - exists [], G, stay. split; [constructor|]. split; auto. split; auto. intros r (u & h & [] & _).
  - destruct (a_move_less stay D G s E P SB M) as (m1 & G1 & stay1 & R1 & SB1 & Keep1 & Home1).
    destruct (IH (move_possible s D E P M) stay1 G1 SB1) as (m2 & G2 & stay2 & R2 & SB2 & Keep2 & Home2).
    exists (m1 ++ m2), G2, stay2. split; [eapply run_app; eauto|]. split; auto. split; auto.
    intros r (u & h & [<-|I] & N & Hh & W); [subst r; eauto|]. apply Home2. exists u, h. auto.
Qed.

Theorem live_then_home D : possible D -> live D -> can_come_home D.
Proof.
  intros P (L & K & LD). destruct (everyone_comes_home L D robots K LD P (le_n _)) as (l & E & R & LE & All).
  assert (SB : same_but (fun _ => None) D D).
  { split; [discriminate|]. intro p. right. split; [discriminate|]. symmetry. apply filter_all. auto. }
  destruct (a_run_less D l E R P _ D SB) as (m & F & stay & RF & [Are Here] & _ & Home). exists m, F. split; auto.
  intros p s I. destruct (Here p) as [(r & h & Sr & Ph & Fp)|[_ Fp]]; rewrite Fp in I.
  - destruct I as [<-|[]]. left. apply (Are r h Sr).
  - apply filter_In in I. destruct I as [I Fs]. destruct (All p s I (who_is s)) as [C|N]; auto. exfalso.
    apply (Home _ C). unfold free in Fs. destruct (stay (who s)); [discriminate|auto].
Qed.

Theorem live_iff_home D : possible D -> (live D <-> can_come_home D).
Proof. intro P. split; [apply live_then_home|apply home_then_live]; auto. Qed.
End Homes.
Print Assumptions home_then_live.
Print Assumptions live_then_home.
Print Assumptions live_iff_home.
